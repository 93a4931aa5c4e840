#pragma once

#include <fmt/compile.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

namespace cb {

/// Characters that one number needs at most.
inline constexpr int number_room = 32;

/// Shortest decimal that reads back as the same double; nothing for NaN and infinity, which leave their cell empty.
inline char* print_number(char* out, double x) {
  if (x == 0) {
    if (std::signbit(x)) *out++ = '-';
    *out++ = '0';
    return out;
  }
  if (!std::isfinite(x)) return out;
  return fmt::format_to(out, FMT_COMPILE("{}"), x);
}
inline char* print_number(char* out, const std::optional<double>& x) { return x ? print_number(out, *x) : out; }
inline char* print_number(char* out, long x) { return std::to_chars(out, out + number_room, x).ptr; }
inline char* print_number(char* out, int x) { return print_number(out, static_cast<long>(x)); }

inline char* print_text(char* out, std::string_view text) { return out + text.copy(out, text.size()); }

/// The same number as a string: for directory names and messages.
inline std::string number_text(double x) { return fmt::format(FMT_COMPILE("{}"), x); }

/// A cell of a CSV file: quoted where it holds a comma, a quote or a line break.
std::string csv_cell(std::string_view text);

}  // namespace cb
