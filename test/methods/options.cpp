// What flags say of themselves against what the options hold.

#include "methods/options.h"

#include <catch2/catch.hpp>
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
