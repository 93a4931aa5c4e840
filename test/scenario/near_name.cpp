// What a message says of a name or a number that is wrong.
#include "scenario/near_name.h"

#include <catch2/catch.hpp>

#include "scenario/values.h"

using namespace cb;

TEST_CASE("letters inserted, deleted, replaced and swapped count one each") {
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("abc", "abc") == 0);
  CHECK(edit_distance("abc", "abxc") == 1);
  CHECK(edit_distance("abc", "ac") == 1);
  CHECK(edit_distance("abc", "axc") == 1);
  CHECK(edit_distance("abc", "acb") == 1);
  CHECK(edit_distance("kitten", "sitting") == 3);
}

TEST_CASE("the nearest names are proposed, up to three, and all are listed where none or too many are near") {
  const std::vector<std::string> names = {"friction", "fraction", "duration", "step"};
  CHECK(suggest("frction", names, "it takes:") == "did you mean \"friction\" or \"fraction\"?");
  CHECK(suggest("stpe", names, "it takes:") == "did you mean \"step\"?");
  CHECK(suggest("gravity", names, "it takes:") == "it takes: friction, fraction, duration, step");
  CHECK(suggest("x", names, "it takes:") == "it takes: friction, fraction, duration, step");
  CHECK(suggest("ab", {"aa", "ac", "ad"}, "it takes:") == "did you mean \"aa\" or \"ac\" or \"ad\"?");
  CHECK(suggest("ab", {"aa", "ac", "ad", "ae"}, "it takes:") == "it takes: aa, ac, ad, ae");
  // A third of the letters at most: two of six, not three.
  CHECK(suggest("abcdef", {"abcdxy"}, "it takes:") == "did you mean \"abcdxy\"?");
  CHECK(suggest("abcdef", {"abcxyz"}, "it takes:") == "it takes: abcxyz");
  // Of near ones the nearest alone, wherever it is in the list.
  CHECK(suggest("abcdef", {"abcdxy", "abcdex"}, "it takes:") == "did you mean \"abcdex\"?");
  CHECK(suggest("abcdef", {"abcdex", "abcdxy"}, "it takes:") == "did you mean \"abcdex\"?");
  const std::vector<std::string> many(21, "name");
  CHECK(suggest("zzz", many, "it takes:").ends_with("name, ..."));
  CHECK(suggest("zzz", {many.begin(), many.end() - 1}, "it takes:").ends_with("name, name"));
}

TEST_CASE("a range says what it allows, and contains that") {
  CHECK(any_number.text().empty());
  CHECK(positive.text() == "more than 0");
  CHECK(not_negative.text() == "at least 0");
  const Range fraction{0, 1}, most{.high = 5};
  CHECK(fraction.text() == "from 0 to 1");
  CHECK(most.text() == "at most 5");
  CHECK_FALSE(positive.contains(0));
  CHECK(not_negative.contains(0));
  CHECK(fraction.contains(1));
  CHECK_FALSE(fraction.contains(1.0000001));
}
