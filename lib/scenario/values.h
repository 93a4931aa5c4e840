#pragma once

#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "scenario/expression.h"
#include "scenario/scenario.h"
#include "scenario/xml_tree.h"

namespace cb {

/// Where a number has to lie; both ends belong to it unless `low_open`.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;

  bool contains(double x) const { return (low_open ? x > low : x >= low) && x <= high; }
  /// "more than 0", "from 0 to 1", "at least 1"; empty where everything is allowed.
  std::string text() const;
};
inline constexpr Range any_number{};
inline constexpr Range positive{0, std::numeric_limits<double>::infinity(), true};
inline constexpr Range not_negative{0, std::numeric_limits<double>::infinity(), false};

/// Reads the values of attributes: numbers, or ${expressions} of the parameters that the scenario declares.
/// All functions throw InputError.
class Values {
 public:
  Values(const SourceText& source, const Overrides& overrides) : source_(source), overrides_(overrides) {}

  /// Reads <parameters> (nullptr where there is none) and puts the overrides in force.
  void declare(const XmlElement* parameters);

  /// `meaning`: what the numbers are, for messages: "x y z in m".
  std::vector<double> numbers(const XmlAttribute& attribute, std::size_t count, std::string_view meaning);
  /// Any number of points of three coordinates each, all in one row.
  std::vector<double> points(const XmlAttribute& attribute);
  /// Any number of them.
  std::vector<double> row(const XmlAttribute& attribute);
  double number(const XmlAttribute& attribute, const Range& range);
  long integer(const XmlAttribute& attribute, long low, long high);
  /// One of `choices`, or ${name} of a parameter of type word whose value is one of them.
  std::string word(const XmlAttribute& attribute, const std::vector<std::string>& choices);

  /// Something is wrong with the value of this attribute: adds which overrides had a hand in it.
  [[noreturn]] void fail(const XmlAttribute& attribute, const std::string& message) const;
  /// `index` is this number in what is read from now on: which copy of an array, from 0. none_of_array: no such name.
  void set_index(long index);
  static constexpr long none_of_array = -1;
  void check_all_used() const;
  /// Fills `parameters` and `parameter_notes`.
  void report(Scenario& scenario) const;

 private:
  enum class Type { number, integer, word };
  struct Parameter {
    std::string name;
    Type type = Type::number;
    Range range;
    std::vector<std::string> choices;
    std::size_t at = 0;  ///< offset of the name
    bool derived = false;
    ParameterNote note;

    std::string takes() const;  ///< "a number, at least 0"
  };

  void declare_parameter(const XmlElement& element);
  void declare_derived(const XmlElement& element);
  void claim_name(const XmlElement& element, Parameter& parameter);
  void set_default(const Parameter& parameter, const XmlAttribute& attribute);
  std::string text_in_force(const Parameter& parameter) const;
  void override_parameter(const Parameter& parameter, const std::string& text);
  void check_overrides() const;
  std::vector<double> tokens(const XmlAttribute& attribute, const Scope& scope, std::set<std::string>& used) const;
  std::string note(const XmlAttribute& attribute) const;

  const SourceText& source_;
  const Overrides& overrides_;
  std::vector<Parameter> parameters_;
  Scope scope_;
  std::set<std::string> used_;
  /// Per name: the overrides that its value comes from.
  std::map<std::string, std::set<std::string>> overridden_;
};

/// Refuses attributes that are not listed, and tells those that are missing.
void check_attributes(const SourceText& source, const XmlElement& element, const std::vector<std::string>& required,
                      const std::vector<std::string>& optional);
/// Refuses any child element.
void check_empty(const SourceText& source, const XmlElement& element);

}  // namespace cb
