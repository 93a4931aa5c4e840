// What can be read stays so: functions and files of the sources do not outgrow a screen or two.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

// Rooms of algorithms, which are held to more.
const std::set<std::string> algorithms = {"cone", "methods", "lcp", "ncp"};
constexpr int lines_of_a_function = 80, lines_of_an_algorithm = 60, lines_of_an_algorithms_file = 400;

struct Function {
  int first, lines;
};

/// The same text without comments, string and character literals and preprocessor lines; lines stay where they are.
std::string code_of(const std::string& text) {
  std::string out = text;
  const auto blank = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < std::min(to, out.size()); ++i)
      if (out[i] != '\n') out[i] = ' ';
  };
  bool line_start = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    std::size_t end = i;
    if (text.compare(i, 2, "//") == 0 || (c == '#' && line_start)) {
      end = text.find('\n', i);
    } else if (text.compare(i, 2, "/*") == 0) {
      end = text.find("*/", i) + 2;
    } else if (text.compare(i, 3, "R\"(") == 0) {
      end = text.find(")\"", i) + 2;
    } else if (c == '"' || (c == '\'' && (i == 0 || !std::isalnum(static_cast<unsigned char>(text[i - 1]))))) {
      for (end = i + 1; end < text.size() && text[end] != c; ++end)
        if (text[end] == '\\') ++end;
      ++end;
    }
    line_start = c == '\n' || (line_start && (c == ' ' || c == '\t'));
    if (end == i) continue;
    end = std::min(end, text.size());
    blank(i, end);
    i = end - 1;
  }
  return out;
}

bool has_word(const std::string& text, const std::string& word) {
  const auto part_of_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    if ((at == 0 || !part_of_word(text[at - 1])) &&
        (at + word.size() == text.size() || !part_of_word(text[at + word.size()])))
      return true;
  return false;
}

/// Where the brace at `open` closes.
std::size_t end_of(const std::string& code, std::size_t open) {
  int depth = 0;
  for (std::size_t i = open; i < code.size(); ++i) {
    depth += code[i] == '{' ? 1 : code[i] == '}' ? -1 : 0;
    if (depth == 0) return i;
  }
  return code.size() - 1;
}

/// The functions of a source, from the first line of their declaration to their last brace. What opens a brace outside
/// of functions is a namespace or a type, whose inside is looked at; else, with a parenthesis before it, a function;
/// else a table of data.
std::vector<Function> functions_of(const std::string& text) {
  const std::string code = code_of(text);
  std::vector<Function> found;
  std::size_t head = 0;  // where the present declaration begins
  const auto line_of = [&](std::size_t at) {
    return 1 + static_cast<int>(std::count(code.begin(), code.begin() + static_cast<long>(at), '\n'));
  };
  for (std::size_t i = 0; i < code.size(); ++i) {
    if (code[i] == ';' || code[i] == '}') head = i + 1;
    if (code[i] != '{') continue;
    const std::string before = code.substr(head, i - head);
    const bool called = before.find('(') != std::string::npos;
    const auto opens = [&](const char* word) { return has_word(before, word) && !called; };
    if (opens("namespace") || opens("class") || opens("struct") || opens("union")) {
      head = i + 1;
      continue;
    }
    std::size_t end = end_of(code, i);
    // Members that a constructor begins with braces come before its body.
    for (std::size_t next = code.find_first_not_of(" \n", end + 1);
         called && next != std::string::npos && (code[next] == ',' || code[next] == '{');
         next = code.find_first_not_of(" \n", end + 1))
      end = end_of(code, code.find('{', next));
    const std::size_t first = code.find_first_not_of(" \n", head);
    if (called) found.push_back({line_of(first), line_of(end) - line_of(first) + 1});
    i = end;
    head = end + 1;
  }
  return found;
}

std::string read(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

TEST_CASE(
    "no function of lib is longer than 80 lines, none of an algorithm's room longer than 60, no file there than 400") {
  int functions = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(fs::path(SOURCE_ROOT) / "lib")) {
    const fs::path& path = entry.path();
    if (path.extension() != ".cpp" && path.extension() != ".h") continue;
    const std::string text = read(path), name = fs::relative(path, SOURCE_ROOT).string();
    const bool algorithm = algorithms.contains(path.parent_path().filename().string());
    const int limit = algorithm ? lines_of_an_algorithm : lines_of_a_function;
    for (const Function& function : functions_of(text)) {
      ++functions;
      if (function.lines > limit)
        FAIL_CHECK(name << ":" << function.first << ": a function of " << function.lines << " lines");
    }
    const auto lines = std::count(text.begin(), text.end(), '\n');
    if (algorithm && lines > lines_of_an_algorithms_file) FAIL_CHECK(name << ": a file of " << lines << " lines");
  }
  CHECK(functions > 1000);
}

TEST_CASE("functions are found with their lengths, whatever stands around them") {
  const auto lengths = [](const std::string& text) {
    std::vector<int> lines;
    for (const Function& function : functions_of(text)) lines.push_back(function.lines);
    return lines;
  };
  CHECK(lengths("int f() {\n  return 1;\n}\n") == std::vector<int>{3});
  CHECK(lengths("namespace a {\nstruct B {\n  int c() { return 0; }\n  int d = 3;\n};\n}\n") == std::vector<int>{1});
  CHECK(lengths("B::B(int x)\n    : a_{x},\n      b_{2} {\n  if (x) {\n  }\n}\n") == std::vector<int>{6});
  CHECK(lengths("const int table[] = {1, 2};\nenum class E { a, b };\nvoid f() {\n}\n") == std::vector<int>{2});
  CHECK(lengths("// f() {\nchar c = '{';\nconst char* s = \"}{\";\n#define X {\nint g(\n    int y) {\n}\n") ==
        std::vector<int>{3});
  CHECK(
      lengths("template <class T>\nT f(T x) {\n  const auto g = [&](int y) {\n    return y;\n  };\n  return x;\n}\n") ==
      std::vector<int>{7});
}
