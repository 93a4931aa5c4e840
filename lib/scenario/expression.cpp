#include "scenario/expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "scenario/near_name.h"

namespace cb {

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr int depth_limit = 100;  // parentheses within parentheses
const std::vector<std::string>& functions() {
  static const std::vector<std::string> names{"sin", "cos", "tan", "acos", "sqrt", "min", "max", "floor", "mod", "if"};
  return names;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool in_name(char c) { return is_letter(c) || is_digit(c) || c == '_'; }

class Parser {
 public:
  Parser(std::string_view text, const Scope& scope, std::set<std::string>& used)
      : text_(text), scope_(scope), used_(used) {}

  double whole() {
    const double value = sum();
    if (at_ < text_.size()) {
      if (text_[at_] == ',') fail("a comma outside of a function; numbers have a decimal point");
      if (text_[at_] == '^') fail("there is no ^; write a product");
      fail(fmt::format("\"{}\" is not expected here; put an operator (+ - * /) between two values", text_.substr(at_)));
    }
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw ExpressionError(at_, message); }
  [[noreturn]] static void fail_at(std::size_t at, const std::string& message) { throw ExpressionError(at, message); }

  void skip_space() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n' || text_[at_] == '\r'))
      ++at_;
  }
  char peek() {
    skip_space();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool take(char c) {
    if (peek() != c) return false;
    ++at_;
    skip_space();
    return true;
  }
  void expect(char c, std::string_view where) {
    if (!take(c)) fail(fmt::format("'{}' is missing {}", c, where));
  }
  std::string name() {
    skip_space();
    const std::size_t begin = at_;
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    std::string found(text_.substr(begin, at_ - begin));
    skip_space();
    return found;
  }
  /// A branch that is not chosen may divide by zero: its value is not used.
  double finite(double value, std::size_t at, std::string_view what) const {
    if (chosen_ && !std::isfinite(value)) fail_at(at, fmt::format("{} is not finite", what));
    return std::isfinite(value) ? value : 0;
  }

  double sum() {
    if (++depth_ > depth_limit) fail("parentheses too deep; simplify the expression");
    double value = product();
    while (true) {
      const char c = peek();
      const std::size_t at = at_;
      if (!take('+') && !take('-')) break;
      const double right = product();
      value = finite(c == '+' ? value + right : value - right, at, c == '+' ? "the sum" : "the difference");
    }
    --depth_;
    return value;
  }

  double product() {
    double value = factor();
    while (true) {
      const char c = peek();
      const std::size_t at = at_;
      if (!take('*') && !take('/')) break;
      const double right = factor();
      if (chosen_ && c == '/' && right == 0) fail_at(at, "division by zero");
      value = finite(c == '*' ? value * right : value / right, at, c == '*' ? "the product" : "the quotient");
    }
    return value;
  }

  double factor() {
    double sign = 1;
    while (true) {
      if (take('-'))
        sign = -sign;
      else if (!take('+'))
        break;
    }
    const char c = peek();
    if (c == '\0') fail(text_.empty() ? "an empty expression; write a number" : "a number or a name is missing here");
    if (take('(')) {
      const double value = sum();
      expect(')', "to close the parenthesis");
      return sign * value;
    }
    if (is_digit(c) || c == '.') return sign * number();
    if (is_letter(c)) return sign * named();
    if (c == ',') fail("a number or a name is missing before the comma");
    fail(fmt::format("'{}' is not expected here; write a number, a name or a parenthesis", c));
  }

  double number() {
    double value = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error == std::errc::invalid_argument) fail("a number is missing here");
    const std::size_t begin = at_;
    at_ = static_cast<std::size_t>(end - text_.data());
    if (error == std::errc::result_out_of_range)
      fail_at(begin, fmt::format("{} is beyond the range of numbers", text_.substr(begin, at_ - begin)));
    if (at_ < text_.size() && (in_name(text_[at_]) || text_[at_] == '.'))
      fail(
          fmt::format("\"{}\" is no number; put an operator between two values", text_.substr(begin, at_ - begin + 1)));
    skip_space();
    return value;
  }

  double named() {
    const std::size_t begin = at_;
    const std::string found = name();
    if (at_ < text_.size() && text_[at_] == '(') return found == "if" ? choice() : function(found, begin);
    if (found == "pi") return std::numbers::pi;
    if (found == "deg") return degree;
    const auto entry = scope_.find(found);
    if (entry == scope_.end()) {
      if (std::find(functions().begin(), functions().end(), found) != functions().end())
        fail_at(begin, fmt::format("{0} is a function; write {0}(...)", found));
      fail_unknown(found, begin);
    }
    used_.insert(found);
    if (entry->second.is_word)
      fail_at(begin, fmt::format("{0} is a word ({1}), not a number; write if({0} = {2}, this, else that)", found,
                                 join(entry->second.choices, ", "), entry->second.choices.front()));
    return entry->second.number;
  }

  [[noreturn]] void fail_unknown(const std::string& found, std::size_t at) const {
    std::vector<std::string> names;
    for (const auto& [known, value] : scope_) names.push_back(known);
    names.insert(names.end(), {"pi", "deg"});
    fail_at(at, fmt::format("there is no parameter \"{}\"; {}", found, suggest(found, names, "known here:")));
  }

  double function(const std::string& found, std::size_t begin) {
    if (std::find(functions().begin(), functions().end(), found) == functions().end())
      fail_at(begin,
              fmt::format("there is no function \"{}\"; {}", found, suggest(found, functions(), "the functions are:")));
    expect('(', "after the function");
    std::vector<double> x{sum()};
    while (take(',')) x.push_back(sum());
    expect(')', "to close the function");
    const bool many = found == "min" || found == "max", two = found == "mod";
    if (two ? x.size() != 2 : many ? x.size() < 2 : x.size() != 1)
      fail_at(begin, fmt::format("{} takes {}, not {}", found,
                                 two    ? "two numbers"
                                 : many ? "two numbers or more"
                                        : "one number",
                                 x.size()));
    if (found == "sin") return std::sin(x[0]);
    if (found == "cos") return std::cos(x[0]);
    if (found == "tan") return std::tan(x[0]);
    if (found == "min") return *std::min_element(x.begin(), x.end());
    if (found == "max") return *std::max_element(x.begin(), x.end());
    if (found == "floor") return std::floor(x[0]);
    if (found == "mod") {
      if (chosen_ && x[1] == 0) fail_at(begin, "mod by zero");
      return finite(x[0] - x[1] * std::floor(x[0] / x[1]), begin, "mod");
    }
    if (found == "acos") {
      if (chosen_ && std::abs(x[0]) > 1) fail_at(begin, fmt::format("acos({}); it takes numbers from -1 to 1", x[0]));
      return finite(std::acos(x[0]), begin, "acos");
    }
    if (chosen_ && x[0] < 0) fail_at(begin, fmt::format("sqrt({}); it takes no negative number", x[0]));
    return finite(std::sqrt(x[0]), begin, "sqrt");
  }

  double choice() {
    expect('(', "after if");
    const std::size_t begin = at_;
    const std::string parameter = name();
    const auto entry = scope_.find(parameter);
    if (entry == scope_.end()) fail_unknown(parameter, begin);
    used_.insert(parameter);
    if (!entry->second.is_word)
      fail_at(begin,
              fmt::format("{} is a number; an if asks for a word: if(start = rest, this, else that)", parameter));
    expect('=', "after the parameter: if(start = rest, this, else that)");
    const std::size_t word_at = at_;
    const std::string word = name();
    if (std::find(entry->second.choices.begin(), entry->second.choices.end(), word) == entry->second.choices.end())
      fail_at(word_at, fmt::format("{} is never \"{}\"; {}", parameter, word,
                                   suggest(word, entry->second.choices, "its words are:")));
    expect(',', "before the value of this case");
    const bool outer = chosen_, met = entry->second.word == word;
    chosen_ = outer && met;
    const double yes = sum();
    expect(',', "before the value of the other cases");
    chosen_ = outer && !met;
    const double no = sum();
    chosen_ = outer;
    expect(')', "to close the if");
    return met ? yes : no;
  }

  std::string_view text_;
  const Scope& scope_;
  std::set<std::string>& used_;
  std::size_t at_ = 0;
  int depth_ = 0;
  bool chosen_ = true;  ///< is the part that is read now the one whose value counts?
};

}  // namespace

double evaluate(std::string_view text, const Scope& scope, std::set<std::string>& used) {
  return Parser(text, scope, used).whole() + 0.0;  // -0 becomes 0
}

bool read_number(std::string_view text, double& value) {
  const std::size_t digits = !text.empty() && (text.front() == '-' || text.front() == '+') ? 1 : 0;
  if (text.size() <= digits || (!is_digit(text[digits]) && text[digits] != '.')) return false;  // no inf, no nan
  if (text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  value += 0.0;  // -0 becomes 0
  return error == std::errc() && end == text.data() + text.size();
}

bool is_name(std::string_view text) {
  return !text.empty() && is_letter(text.front()) && std::all_of(text.begin(), text.end(), in_name);
}

bool is_reserved(std::string_view name) {
  return name == "pi" || name == "deg" || name == "index" ||
         std::find(functions().begin(), functions().end(), name) != functions().end();
}

}  // namespace cb
