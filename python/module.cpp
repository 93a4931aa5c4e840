// The compiled part of the Python module (docs/python.md).
#include <cctype>

#include "../app/commands.h"
#include "../app/versions.h"
#include "answers.h"
#include "interrupt.h"
#include "problem.h"
#include "run.h"
#include "scenario/scenario.h"

namespace cb {
void print_error(const std::string&) {}
}  // namespace cb

namespace {

/// What the program says of its flags, as they are written here: --epsilon-relative, epsilon_relative.
std::string in_words_of_python(std::string message) {
  for (std::size_t at = message.find("--"); at != std::string::npos; at = message.find("--", at + 1)) {
    if (at > 0 && message[at - 1] != ' ') continue;  // of a file's name
    message.erase(at, 2);
    for (; at < message.size() && (std::isalnum(static_cast<unsigned char>(message[at])) || message[at] == '-'); ++at)
      if (message[at] == '-') message[at] = '_';
  }
  return message;
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  using namespace cb;
  namespace py = pybind11;
  static py::exception<python::ArgumentError> error(module, "Error", PyExc_ValueError);
  error.attr("__doc__") = "Wrong input, in one line: what, and what would be right.";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const python::ArgumentError& known) {
      error(in_words_of_python(known.what()).c_str());
    } catch (const FileError& known) {
      error(in_words_of_python(known.what()).c_str());
    } catch (const InputError& known) {
      error(in_words_of_python(known.what()).c_str());
    } catch (const UsageError& known) {
      error(in_words_of_python(known.what()).c_str());
    }
  });
  python::add_interrupt(module);
  python::add_problem(module);
  python::add_answers(module);
  python::add_run(module);
  module.attr("__version__") = versions().contactbench;
  module.attr("version_line") = version_line();
  py::list names, law_names;
  for (const MethodRow& row : methods()) names.append(std::string(row.name));
  for (const Law& law : laws()) law_names.append(std::string(law.name));
  module.attr("methods") = py::tuple(names);
  module.attr("laws") = py::tuple(law_names);
}
