#include "scenario/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenario/near_name.h"

namespace cb {

namespace {

constexpr double largest_integer = 9007199254740992;  // 2^53: beyond, neighbours are more than 1 apart

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool is_integer(double x) { return std::floor(x) == x && std::abs(x) <= largest_integer; }

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < text.size();) {
    if (is_space(text[i])) {
      ++i;
      continue;
    }
    const std::size_t begin = i;
    while (i < text.size() && !is_space(text[i])) ++i;
    found.push_back(text.substr(begin, i - begin));
  }
  return found;
}

/// Offset of a place in an attribute's value; its beginning where character references shift the text.
std::size_t place(const SourceText& source, const XmlAttribute& attribute, std::size_t i) {
  const bool plain = source.text.compare(attribute.value_at, attribute.value.size(), attribute.value) == 0;
  return attribute.value_at + (plain ? i : 0);
}

}  // namespace

std::string Range::text() const {
  const bool below = std::isfinite(low), above = std::isfinite(high);
  if (below && above) return fmt::format("from {} to {}", low, high);
  if (below) return fmt::format("{} {}", low_open ? "more than" : "at least", low);
  if (above) return fmt::format("at most {}", high);
  return {};
}

std::string Values::Parameter::takes() const {
  if (type == Type::word) return "one of: " + join(choices);
  const std::string limits = range.text();
  return (type == Type::integer ? "an integer" : "a number") + (limits.empty() ? "" : ", " + limits);
}

// Declarations ------------------------------------------------------------------------------------------------------

void Values::declare(const XmlElement* parameters) {
  if (parameters != nullptr) {
    check_attributes(source_, *parameters, {}, {});
    for (const XmlElement& child : parameters->children) {
      if (child.name == "parameter")
        declare_parameter(child);
      else if (child.name == "derived")
        declare_derived(child);
      else
        source_.fail(child.at, fmt::format("<{}> in <parameters>; {}", child.name,
                                           suggest(child.name, {"parameter", "derived"}, "it holds:")));
    }
  }
  check_overrides();
}

void Values::claim_name(const XmlElement& element, Parameter& parameter) {
  const XmlAttribute& name = *element.find("name");
  parameter.name = name.value;
  parameter.at = name.value_at;
  if (!is_name(name.value))
    source_.fail(name.value_at, fmt::format("\"{}\" is no name for a parameter; a name is a letter, then letters, "
                                            "digits and underscores",
                                            name.value));
  if (is_reserved(name.value))
    source_.fail(name.value_at, fmt::format("{} means something else in expressions; take another name", name.value));
  for (const Parameter& other : parameters_)
    if (other.name == name.value)
      source_.fail(name.value_at, fmt::format("the parameter {} is declared twice (first at {}); rename one",
                                              name.value, source_.where(other.at)));
}

void Values::declare_parameter(const XmlElement& element) {
  check_empty(source_, element);
  const XmlAttribute* type = element.find("type");
  const bool word = type != nullptr && type->value == "word";
  if (word)
    check_attributes(source_, element, {"name", "type", "default", "choices", "description"}, {});
  else
    check_attributes(source_, element, {"name", "type", "default", "description"}, {"unit", "minimum", "maximum"});

  Parameter parameter;
  claim_name(element, parameter);
  if (word)
    parameter.type = Type::word;
  else if (type->value == "integer")
    parameter.type = Type::integer;
  else if (type->value != "number")
    source_.fail(type->value_at, fmt::format("there is no type \"{}\"; {}", type->value,
                                             suggest(type->value, {"number", "integer", "word"}, "the types are:")));

  if (word) {
    const XmlAttribute& choices = *element.find("choices");
    parameter.choices = words(choices.value);
    if (parameter.choices.empty())
      source_.fail(choices.value_at, "no choices; list the words that are allowed, as in choices=\"steady rest\"");
    for (auto choice = parameter.choices.begin(); choice != parameter.choices.end(); ++choice) {
      if (!is_name(*choice))
        source_.fail(
            choices.value_at,
            fmt::format("\"{}\" is no word; a word is a letter, then letters, digits and underscores", *choice));
      if (std::find(parameter.choices.begin(), choice, *choice) != choice)
        source_.fail(choices.value_at, fmt::format("the choice {} is listed twice; keep one", *choice));
    }
  }

  std::set<std::string> none;
  for (const auto& [name, bound] : {std::pair{"minimum", &Range::low}, std::pair{"maximum", &Range::high}}) {
    const XmlAttribute* attribute = element.find(name);
    if (attribute == nullptr) continue;
    const std::vector<double> read = tokens(*attribute, {}, none);
    if (read.size() != 1) source_.fail(attribute->value_at, fmt::format("{} takes one number", name));
    parameter.range.*bound = read[0];
  }
  if (parameter.range.low > parameter.range.high)
    source_.fail(element.find("maximum")->value_at,
                 fmt::format("the maximum {} of {} is less than its minimum {}; swap them", parameter.range.high,
                             parameter.name, parameter.range.low));

  set_default(parameter, *element.find("default"));
  parameter.note = {parameter.takes(), {}, text_in_force(parameter), element.find("description")->value};
  if (const XmlAttribute* unit = element.find("unit")) parameter.note.unit = unit->value;
  for (const auto& [name, text] : overrides_)
    if (name == parameter.name) override_parameter(parameter, text);
  parameters_.push_back(std::move(parameter));
}

void Values::set_default(const Parameter& parameter, const XmlAttribute& attribute) {
  NamedValue value;
  if (parameter.type == Type::word) {
    value.is_word = true;
    value.choices = parameter.choices;
    value.word = attribute.value;
    if (std::find(value.choices.begin(), value.choices.end(), value.word) == value.choices.end())
      source_.fail(attribute.value_at, fmt::format("the default \"{}\" is none of the choices; {}", value.word,
                                                   suggest(value.word, value.choices, "they are:")));
  } else {
    std::set<std::string> none;
    const std::vector<double> read = tokens(attribute, {}, none);
    if (read.size() != 1)
      source_.fail(attribute.value_at, fmt::format("the default of {} has to be one number", parameter.name));
    value.number = read[0];
    if (!parameter.range.contains(value.number) || (parameter.type == Type::integer && !is_integer(value.number)))
      source_.fail(attribute.value_at, fmt::format("the default of {} is {}; it has to be {}", parameter.name,
                                                   value.number, parameter.takes()));
  }
  scope_[parameter.name] = value;
}

void Values::override_parameter(const Parameter& parameter, const std::string& text) {
  const auto fail_set = [&](const std::string& message) {
    throw InputError(one_line(fmt::format("--set {}={}: {}; {} takes {} (declared at {})", parameter.name, text,
                                          message, parameter.name, parameter.takes(), source_.where(parameter.at))));
  };
  NamedValue& value = scope_[parameter.name];
  overridden_[parameter.name] = {parameter.name + " = " + text};
  if (parameter.type == Type::word) {
    if (std::find(value.choices.begin(), value.choices.end(), text) == value.choices.end())
      fail_set(fmt::format("there is no choice \"{}\"", text));
    value.word = text;
    return;
  }
  std::set<std::string> none;
  try {
    value.number = evaluate(text, {}, none);
  } catch (const ExpressionError& error) {
    fail_set(is_name(text) ? fmt::format("\"{}\" is no number", text) : std::string(error.what()));
  }
  if (parameter.type == Type::integer && !is_integer(value.number)) fail_set("this is no integer");
  if (!parameter.range.contains(value.number)) fail_set("out of range");
}

void Values::declare_derived(const XmlElement& element) {
  check_attributes(source_, element, {"name", "value"}, {});
  check_empty(source_, element);
  Parameter parameter;
  parameter.derived = true;
  claim_name(element, parameter);

  const XmlAttribute& attribute = *element.find("value");
  std::set<std::string> used;
  const std::vector<double> read = tokens(attribute, scope_, used);
  if (read.size() != 1)
    source_.fail(attribute.value_at, fmt::format("the value of {} has to be one number", parameter.name));
  for (const std::string& name : used) {
    const auto from = overridden_.find(name);
    if (from != overridden_.end()) overridden_[parameter.name].insert(from->second.begin(), from->second.end());
  }
  used_.insert(used.begin(), used.end());
  NamedValue value;
  value.number = read[0];
  scope_[parameter.name] = value;
  parameters_.push_back(std::move(parameter));
}

void Values::set_index(long index) {
  if (index == none_of_array)
    scope_.erase("index");
  else
    scope_["index"].number = static_cast<double>(index);
}

void Values::check_overrides() const {
  std::vector<std::string> names;
  for (const Parameter& parameter : parameters_)
    if (!parameter.derived) names.push_back(parameter.name);
  std::set<std::string> seen;
  for (const auto& [name, text] : overrides_) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw InputError(one_line(
          fmt::format("--set {}={}: {} declares no parameter \"{}\"; {}", name, text, source_.file, name,
                      names.empty() ? std::string("it declares none") : suggest(name, names, "its parameters are:"))));
    if (!seen.insert(name).second)
      throw InputError(one_line(fmt::format("--set {}={}: {} is set twice; keep one", name, text, name)));
  }
}

void Values::check_all_used() const {
  for (const Parameter& parameter : parameters_)
    if (used_.find(parameter.name) == used_.end())
      source_.fail(parameter.at, fmt::format("the parameter {0} is never used; write ${{{0}}} where its value belongs, "
                                             "or remove it",
                                             parameter.name));
}

std::string Values::text_in_force(const Parameter& parameter) const {
  const NamedValue& value = scope_.at(parameter.name);
  return value.is_word ? value.word : fmt::format("{}", value.number);  // reads back as the same number
}

void Values::report(Scenario& scenario) const {
  for (const Parameter& parameter : parameters_) {
    if (parameter.derived) continue;
    scenario.parameters.emplace_back(parameter.name, text_in_force(parameter));
    scenario.parameter_notes.push_back(parameter.note);
  }
}

// Values of attributes ----------------------------------------------------------------------------------------------

/// Numbers and ${expressions}, separated by white space.
std::vector<double> Values::tokens(const XmlAttribute& attribute, const Scope& scope,
                                   std::set<std::string>& used) const {
  const std::string& text = attribute.value;
  const auto fail_here = [&](std::size_t i, const std::string& message) {
    source_.fail(place(source_, attribute, i), message + note(attribute));
  };
  std::vector<double> values;
  for (std::size_t i = 0; i < text.size();) {
    if (is_space(text[i])) {
      ++i;
      continue;
    }
    double value = 0;
    if (text.compare(i, 2, "${") == 0) {
      const std::size_t begin = i + 2, end = text.find('}', begin);
      if (end == std::string::npos) fail_here(i, "\"${\" is not closed; write ${expression}");
      try {
        value = evaluate(std::string_view(text).substr(begin, end - begin), scope, used);
      } catch (const ExpressionError& error) {
        fail_here(begin + error.at, fmt::format("{} (in {}=\"{}\")", error.what(), attribute.name, text));
      }
      i = end + 1;
      if (i < text.size() && !is_space(text[i]))
        fail_here(i, fmt::format("\"{}\" right after an expression; put a space between two numbers, or all of one "
                                 "number into one ${{...}}",
                                 text[i]));
    } else {
      const std::size_t begin = i;
      while (i < text.size() && !is_space(text[i])) ++i;
      const std::string token = text.substr(begin, i - begin);
      if (!read_number(token, value)) {
        const std::string shown = token.substr(0, 40);
        if (scope.find(token) != scope.end())
          fail_here(begin, fmt::format("\"{0}\" is no number; for the parameter write ${{{0}}}", shown));
        if (token.find("${") != std::string::npos)
          fail_here(begin, fmt::format("\"{}\" is no number; put all of it into one ${{...}}", shown));
        if (token.find(',') != std::string::npos)
          fail_here(begin, fmt::format("\"{}\" is no number; numbers have a decimal point and are separated by spaces",
                                       shown));
        fail_here(begin, fmt::format("\"{}\" is no number; write one such as 0.5 or 1e-3, or an expression such as "
                                     "${{pi/4}} ({}=\"{}\")",
                                     shown, attribute.name, text.substr(0, 60)));
      }
    }
    values.push_back(value);
  }
  return values;
}

std::vector<double> Values::numbers(const XmlAttribute& attribute, std::size_t count, std::string_view meaning) {
  std::vector<double> values = tokens(attribute, scope_, used_);
  if (values.size() != count)
    fail(attribute, fmt::format("{} has {} number{}; it takes {} ({})", attribute.name, values.size(),
                                values.size() == 1 ? "" : "s", count, meaning));
  return values;
}

std::vector<double> Values::points(const XmlAttribute& attribute) {
  std::vector<double> values = tokens(attribute, scope_, used_);
  if (values.size() % 3 != 0)
    fail(attribute,
         fmt::format("{} has {} numbers; it takes three for each point (x y z in m)", attribute.name, values.size()));
  return values;
}

std::vector<double> Values::row(const XmlAttribute& attribute) { return tokens(attribute, scope_, used_); }

double Values::number(const XmlAttribute& attribute, const Range& range) {
  const std::vector<double> values = tokens(attribute, scope_, used_);
  if (values.size() != 1)
    fail(attribute, fmt::format("{} has {} numbers; it takes one", attribute.name, values.size()));
  if (!range.contains(values[0]))
    fail(attribute, fmt::format("{} is {}; it has to be {}", attribute.name, values[0], range.text()));
  return values[0];
}

long Values::integer(const XmlAttribute& attribute, long low, long high) {
  const double value = number(attribute, any_number);
  if (!is_integer(value) || value < static_cast<double>(low) || value > static_cast<double>(high))
    fail(attribute, fmt::format("{} is {}; it has to be an integer from {} to {}", attribute.name, value, low, high));
  return static_cast<long>(value);
}

std::string Values::word(const XmlAttribute& attribute, const std::vector<std::string>& choices) {
  std::string value = attribute.value;
  if (value.size() > 3 && value.starts_with("${") && value.ends_with("}")) {
    const std::string name = value.substr(2, value.size() - 3);
    const auto found = scope_.find(name);
    if (found == scope_.end() || !found->second.is_word)
      source_.fail(attribute.value_at, fmt::format("{} is no parameter of type word; {} takes one of: {}", name,
                                                   attribute.name, join(choices)));
    used_.insert(name);
    value = found->second.word;
  }
  if (std::find(choices.begin(), choices.end(), value) == choices.end())
    fail(attribute, fmt::format("{} is \"{}\"; {}", attribute.name, value, suggest(value, choices, "it is one of:")));
  return value;
}

void Values::fail(const XmlAttribute& attribute, const std::string& message) const {
  source_.fail(attribute.value_at, message + note(attribute));
}

std::string Values::note(const XmlAttribute& attribute) const {
  std::set<std::string> names, from;
  const std::string& text = attribute.value;
  for (std::size_t i = text.find("${"); i != std::string::npos; i = text.find("${", i + 2)) {
    try {
      evaluate(std::string_view(text).substr(i + 2, text.find('}', i) - i - 2), scope_, names);
    } catch (const ExpressionError&) {
      continue;  // the names before the fault are enough
    }
  }
  for (const std::string& name : names) {
    const auto found = overridden_.find(name);
    if (found != overridden_.end()) from.insert(found->second.begin(), found->second.end());
  }
  if (from.empty()) return {};
  return fmt::format(" [with {} from --set]", join({from.begin(), from.end()}));
}

// Shape of an element ------------------------------------------------------------------------------------------------

void check_attributes(const SourceText& source, const XmlElement& element, const std::vector<std::string>& required,
                      const std::vector<std::string>& optional) {
  std::vector<std::string> known = required;
  known.insert(known.end(), optional.begin(), optional.end());
  for (const XmlAttribute& attribute : element.attributes)
    if (std::find(known.begin(), known.end(), attribute.name) == known.end())
      source.fail(attribute.name_at,
                  fmt::format("<{}> has no attribute \"{}\"; {}", element.name, attribute.name,
                              known.empty() ? "it takes none" : suggest(attribute.name, known, "it takes:")));
  for (const std::string& name : required)
    if (element.find(name) == nullptr)
      source.fail(element.at,
                  fmt::format("<{}> needs the attribute {}; it takes: {}", element.name, name, join(known)));
}

void check_empty(const SourceText& source, const XmlElement& element) {
  if (!element.children.empty())
    source.fail(element.children.front().at,
                fmt::format("<{}> inside <{}>, which holds no elements; close <{}/> before it",
                            element.children.front().name, element.name, element.name));
}

}  // namespace cb
