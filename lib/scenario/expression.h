#pragma once

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cb {

/// What a name in an expression stands for: a number, or a word out of a list.
struct NamedValue {
  bool is_word = false;
  double number = 0;
  std::string word;
  std::vector<std::string> choices;  ///< of a word
};
using Scope = std::map<std::string, NamedValue>;

/// `at`: offset into the expression's text.
struct ExpressionError : std::runtime_error {
  ExpressionError(std::size_t offset, const std::string& message) : std::runtime_error(message), at(offset) {}
  std::size_t at;
};

/// Value of an arithmetic expression, finite:
///   sum      = product { (+|-) product }
///   product  = factor { (*|/) factor }
///   factor   = (+|-) factor | number | name | ( sum ) | function ( sum {, sum} ) | if ( name = word, sum, sum )
///   function = sin cos tan acos sqrt min max floor mod;  names: those of the scope, pi, and deg = pi / 180
/// mod(a, b) = a - b floor(a / b), of the sign of b.
/// Both branches of an `if` must be sound, only the chosen one is computed. Names that occur are added to `used`.
/// Throws ExpressionError.
double evaluate(std::string_view text, const Scope& scope, std::set<std::string>& used);

/// A number as one writes it in a file: 1, -0.5, 1e-3. Nothing else: no expression, no infinity, no blank.
bool read_number(std::string_view text, double& value);

/// A letter, then letters, digits and underscores.
bool is_name(std::string_view text);
/// Names that expressions keep for themselves (pi, sin, if, index ...).
bool is_reserved(std::string_view name);

}  // namespace cb
