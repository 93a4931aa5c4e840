#include "scenario/expression.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "scenario/near_name.h"

using namespace cb;

namespace {

Scope scope() {
  Scope names;
  names["gap"].number = 0.5;
  names["mu"].number = 0.02;
  names["start"].is_word = true;
  names["start"].word = "rest";
  names["start"].choices = {"steady", "rest"};
  return names;
}
double value(const std::string& text) {
  std::set<std::string> used;
  return evaluate(text, scope(), used);
}

}  // namespace

TEST_CASE("Expressions follow the rules of arithmetic") {
  CHECK(value("1 + 2*3") == 7);
  CHECK(value("(1 + 2)*3") == 9);
  CHECK(value("8/4/2") == 1);       // from the left
  CHECK(value("1 - 2 - 3") == -4);  // from the left
  CHECK(value("-2*-3") == 6);
  CHECK(value("--1") == 1);
  CHECK(value("2 - -gap") == 2.5);
  CHECK(value("+gap") == 0.5);
  CHECK(value("2 - +gap") == 1.5);
  CHECK(value("1e-3*1e3") == 1);
  CHECK(value(".5") == 0.5);
  CHECK(value("  gap+1\t") == 1.5);
  CHECK(value("1.5E1") == 15);
  CHECK(value("((((gap))))") == 0.5);
}

TEST_CASE("Functions and constants are those of mathematics") {
  CHECK(value("pi") == std::numbers::pi);
  CHECK(value("180*deg") == Approx(std::numbers::pi).epsilon(1e-15));
  CHECK(value("sin(pi/6)") == Approx(0.5).epsilon(1e-15));
  CHECK(value("cos(60*deg)") == Approx(0.5).epsilon(1e-15));
  CHECK(value("tan(45*deg)") == Approx(1).epsilon(1e-15));
  CHECK(value("acos(-1)") == std::numbers::pi);
  CHECK(value("sqrt(2)*sqrt(2)") == Approx(2).epsilon(1e-15));
  CHECK(value("min(3, 1, 2)") == 1);
  CHECK(value("max(3, 1, 2)") == 3);
  CHECK(value("min(3, 2, 1)") == 1);
  CHECK(value("max(1, 2, 3)") == 3);
  CHECK(value("sin(gap)*sin(gap) + cos(gap)*cos(gap)") == Approx(1).epsilon(1e-15));
}

TEST_CASE("A negative zero never comes out, so that files of results do not depend on signs of zeros") {
  CHECK_FALSE(std::signbit(value("-sin(0)")));
  CHECK_FALSE(std::signbit(value("-0")));
  double x = 1;
  REQUIRE(read_number("-0", x));
  CHECK_FALSE(std::signbit(x));
}

TEST_CASE("An if picks by a word, and does not compute the case that is not asked for") {
  CHECK(value("if(start = rest, 1, 2)") == 1);
  CHECK(value("if(start=steady, 1, 2)") == 2);
  CHECK(value("if(start = steady, sqrt(-1), 3)") == 3);
  CHECK(value("if(start = rest, 3, 1/0)") == 3);
  CHECK(value("if(start = steady, mod(1, 0), 3)") == 3);
  CHECK(value("if(start = steady, 1, if(start = rest, 4, acos(2)))") == 4);
  CHECK(value("2*if(start = rest, 1, 0) + 1") == 3);
  // Nor an if within it, nor what follows that one.
  CHECK(value("if(start = steady, if(start = rest, 1/0, 2), 3)") == 3);
  CHECK(value("if(start = steady, if(start = steady, 1, 1/0), 3)") == 3);
  CHECK(value("if(start = steady, if(start = rest, 1, 2) + 1/0, 3)") == 3);
}

TEST_CASE("mod is what floor leaves, of the sign of the second") {
  CHECK(value("floor(2.5)") == 2);
  CHECK(value("floor(-2.5)") == -3);
  CHECK(value("mod(7, 3)") == 1);
  CHECK(value("mod(-1, 3)") == 2);
  CHECK(value("mod(7, -3)") == -2);
  CHECK(value("mod(2.25, 1)") == 0.25);
}

TEST_CASE("Names count as used in either case of an if, and where a fault follows") {
  std::set<std::string> used;
  evaluate("if(start = rest, 1, gap)", scope(), used);
  CHECK(used == std::set<std::string>{"gap", "start"});
  used.clear();
  CHECK_THROWS_AS(evaluate("mu + ?", scope(), used), ExpressionError);
  CHECK(used == std::set<std::string>{"mu"});
}

TEST_CASE("A wrong expression says where it is wrong and what would be right") {
  struct Row {
    const char* text;
    std::size_t at;
    const char* fragment;
  };
  for (const Row& row : {Row{"", 0, "write a number"},
                         Row{"   ", 3, "missing"},
                         Row{"1 +", 3, "missing"},
                         Row{"1 2", 2, "operator"},
                         Row{"gap mu", 4, "operator"},
                         Row{"1,5", 1, "decimal point"},
                         Row{"2^3", 1, "product"},
                         Row{"(1", 2, "')'"},
                         Row{"1)", 1, "not expected"},
                         Row{"*2", 0, "not expected"},
                         Row{"min(,1)", 4, "missing before the comma"},
                         Row{"1 + .", 4, "a number is missing here"},
                         Row{"gpa", 0, "did you mean \"gap\"?"},
                         Row{"zzzzzz", 0, "known here: gap, mu, start, pi, deg"},
                         Row{"inf", 0, "no parameter"},
                         Row{"nan", 0, "no parameter"},
                         Row{"1 + start", 4, "is a word (steady, rest)"},
                         Row{"sn(1)", 0, "did you mean \"sin\"?"},
                         Row{"atan2(1, 2)", 0, "the functions are: sin"},
                         Row{"sin", 0, "sin(...)"},
                         Row{"sin()", 4, "not expected"},
                         Row{"sin(1, 2)", 0, "one number"},
                         Row{"min(1)", 0, "two numbers or more"},
                         Row{"sqrt(-1)", 0, "negative"},
                         Row{"2*acos(1.5)", 2, "-1 to 1"},
                         Row{"1/0", 1, "division by zero"},
                         Row{"mod(1, 0)", 0, "mod by zero"},
                         Row{"mod(1)", 0, "two numbers, not 1"},
                         Row{"index", 0, "no parameter"},
                         Row{"1/(gap - 0.5)", 1, "division by zero"},
                         Row{"1e308*10", 5, "not finite"},
                         Row{"1e308 + 1e308", 6, "not finite"},
                         Row{"1e999", 0, "range"},
                         Row{"0x10", 1, "no number"},
                         Row{"1.2.3", 3, "no number"},
                         Row{"2gap", 1, "no number"},
                         Row{"if(gap = 1, 2, 3)", 3, "is a number"},
                         Row{"if(start = res, 1, 2)", 11, "did you mean \"rest\"?"},
                         Row{"if(start, 1, 2)", 8, "'='"},
                         Row{"if(start = rest, 1)", 18, "other cases"},
                         Row{"if(sart = rest, 1, 2)", 3, "did you mean \"start\"?"},
                         Row{"1 $ 2", 2, "not expected"}}) {
    INFO(row.text);
    std::string message;
    std::size_t at = 999;
    try {
      value(row.text);
    } catch (const ExpressionError& error) {
      message = error.what();
      at = error.at;
    }
    CHECK(at == row.at);
    CHECK_THAT(message, Catch::Contains(row.fragment));
  }
}

TEST_CASE("Parentheses go 99 deep, and any number of them may stand side by side") {
  CHECK(value(std::string(99, '(') + "1" + std::string(99, ')')) == 1);
  CHECK_THROWS_AS(value(std::string(100, '(') + "1" + std::string(100, ')')), ExpressionError);
  std::string sum = "0";
  for (int i = 0; i < 150; ++i) sum += " + (1)";
  CHECK(value(sum) == 150);
}

TEST_CASE("Thousands of parentheses are refused, not recursed into") {
  CHECK_THROWS_AS(value(std::string(100000, '(')), ExpressionError);
  CHECK_THROWS_AS(value(std::string(100000, '(') + "1" + std::string(100000, ')')), ExpressionError);
  CHECK(value(std::string(100000, '-') + "1") == 1);
}

TEST_CASE("A literal number is what from_chars reads in full, finite, and nothing else") {
  double x = 0;
  for (const char* good : {"0", "1", "-1", "+1", "1.5", ".5", "5.", "1e-3", "1E3", "-.5e+2"}) {
    INFO(good);
    CHECK(read_number(good, x));
    CHECK(x == std::stod(good));
  }
  for (const char* bad : {"", "-", "+", ".", "1,5", "1e", "e3", "inf", "-inf", "nan", "0x10", "1 ", " 1", "1m", "--1",
                          "+-1", "1e999", "one"}) {
    INFO(bad);
    CHECK_FALSE(read_number(bad, x));
  }
}

TEST_CASE("The edit distance counts inserted, lost, wrong and swapped letters") {
  CHECK(edit_distance("", "") == 0);
  CHECK(edit_distance("abc", "abc") == 0);
  CHECK(edit_distance("abc", "") == 3);
  CHECK(edit_distance("mass", "mas") == 1);
  CHECK(edit_distance("gpa", "gap") == 1);
  CHECK(edit_distance("kitten", "sitting") == 3);
  for (const char* a : {"mass", "density", "radius", "x"})
    for (const char* b : {"mas", "destiny", "raduis", ""}) CHECK(edit_distance(a, b) == edit_distance(b, a));
}

TEST_CASE("A near name is proposed, equally near ones together, and a list where none is near") {
  CHECK(suggest("mas", {"mass", "density"}, "it takes:") == "did you mean \"mass\"?");
  CHECK(suggest("of", {"on", "off"}, "it is one of:") == "did you mean \"on\" or \"off\"?");
  CHECK(suggest("w", {"x", "y", "z"}, "it is one of:") == "it is one of: x, y, z");
  CHECK(suggest("", {"x", "y"}, "it is one of:") == "it is one of: x, y");
  CHECK(suggest("weight", {"mass", "density"}, "it takes:") == "it takes: mass, density");
}
