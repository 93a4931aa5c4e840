// What flags say of themselves against what the options hold.

#include "methods/options.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <sstream>
#include <string>

#include "methods/registry.h"

using namespace cb;

TEST_CASE("the default that a flag names is the one that holds where nobody asks for another") {
  for (const MethodRow& row : methods())
    for (const OptionRow& of : row.options) {
      INFO(row.name << " --" << of.flag);
      MethodOptions standard;
      standard.variant = of.variant;
      const OptionValue value = value_of(of, row.options, standard);
      const std::string said(of.default_value);
      if (const bool* on = std::get_if<bool>(&value))
        CHECK(said == (*on ? "on" : "off"));
      else if (const double* number = std::get_if<double>(&value))
        CHECK(std::stod(said) == *number);
      else if (const int* whole = std::get_if<int>(&value))
        CHECK((of.flag == "sweeps" ? *whole == 0 : std::stoi(said) == *whole));
      else
        CHECK(said == "none");
    }
}

TEST_CASE("the example in a flag's message is of that flag, and is what it takes") {
  int examples = 0;
  for (const MethodRow& row : methods())
    for (const OptionRow& of : row.options) {
      const std::string expected(of.expected), before = "as in --";
      const std::size_t at = expected.find(before);
      if (at == std::string::npos) continue;
      INFO(row.name << " --" << of.flag << ": " << expected);
      std::istringstream example(expected.substr(at + before.size()));
      std::string flag;
      double value = -1;
      example >> flag >> value;
      CHECK(flag == of.flag);
      CHECK_FALSE(example.fail());
      CHECK((of.positive ? value > 0 : value >= of.least));
      CHECK(value <= of.most);
      if (of.multiple_of > 1) CHECK(std::fmod(value, of.multiple_of) == 0);
      ++examples;
    }
  CHECK(examples >= 10);
}

TEST_CASE("each flag of a method has a part of its own in the names of runs") {
  for (const MethodRow& row : methods()) {
    std::set<std::string_view> parts;
    for (const OptionRow& of : row.options) {
      INFO(row.name << " --" << of.flag);
      CHECK(parts.insert(of.short_name).second);
    }
  }
}
