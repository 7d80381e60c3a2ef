#include "client/render/lettering.h"

#include <algorithm>
#include <array>

namespace atlas {
namespace {

// A row in three bits, the upper row first.
struct Letter {
  char name;
  std::array<std::uint8_t, 5> rows;
};
constexpr std::array<Letter, 48> kLetters = {
    {{'0', {7, 5, 5, 5, 7}}, {'1', {2, 6, 2, 2, 7}}, {'2', {7, 1, 7, 4, 7}},
     {'3', {7, 1, 7, 1, 7}}, {'4', {5, 5, 7, 1, 1}}, {'5', {7, 4, 7, 1, 7}},
     {'6', {7, 4, 7, 5, 7}}, {'7', {7, 1, 2, 2, 2}}, {'8', {7, 5, 7, 5, 7}},
     {'9', {7, 5, 7, 1, 7}}, {'a', {2, 5, 7, 5, 5}}, {'b', {6, 5, 6, 5, 6}},
     {'c', {3, 4, 4, 4, 3}}, {'d', {6, 5, 5, 5, 6}}, {'e', {7, 4, 6, 4, 7}},
     {'f', {7, 4, 6, 4, 4}}, {'g', {3, 4, 5, 5, 3}}, {'h', {5, 5, 7, 5, 5}},
     {'i', {7, 2, 2, 2, 7}}, {'j', {1, 1, 1, 5, 2}}, {'k', {4, 5, 6, 5, 5}},
     {'l', {4, 4, 4, 4, 7}}, {'m', {0, 7, 7, 5, 5}}, {'n', {6, 5, 5, 5, 5}},
     {'o', {2, 5, 5, 5, 2}}, {'p', {6, 5, 6, 4, 4}}, {'q', {2, 5, 5, 6, 3}},
     {'r', {6, 5, 6, 5, 5}}, {'s', {3, 4, 2, 1, 6}}, {'t', {7, 2, 2, 2, 2}},
     {'u', {5, 5, 5, 5, 7}}, {'v', {5, 5, 5, 5, 2}}, {'w', {5, 5, 7, 7, 5}},
     {'x', {5, 5, 2, 5, 5}}, {'y', {5, 5, 2, 2, 2}}, {'z', {7, 1, 2, 4, 7}},
     {'.', {0, 0, 0, 0, 2}}, {'-', {0, 0, 7, 0, 0}}, {'+', {0, 2, 7, 2, 0}},
     {',', {0, 0, 0, 2, 4}}, {'(', {1, 2, 2, 2, 1}}, {')', {4, 2, 2, 2, 4}},
     {'/', {1, 1, 2, 4, 4}}, {':', {0, 2, 0, 2, 0}}, {'%', {5, 1, 2, 4, 5}},
     {'=', {0, 7, 0, 7, 0}}, {'#', {5, 7, 5, 7, 5}}, {'_', {0, 0, 0, 0, 7}}}};

const Letter* Find(char name) {
  const char small = name >= 'A' && name <= 'Z' ? static_cast<char>(name - 'A' + 'a') : name;
  const auto letter =
      std::find_if(kLetters.begin(), kLetters.end(),
                   [small](const Letter& candidate) { return candidate.name == small; });
  return letter == kLetters.end() ? nullptr : &*letter;
}

// Calls dot(column, row) for every dot of a text.
template <typename OnDot>
void ForEachDot(std::string_view text, const OnDot& dot) {
  std::int64_t left = 0;
  for (const char name : text) {
    const Letter* const letter = Find(name);
    for (std::size_t row = 0; letter != nullptr && row < letter->rows.size(); ++row) {
      for (std::int64_t column = 0; column < 3; ++column) {
        if (((letter->rows[row] >> (2 - column)) & 1) != 0) {
          dot(left + column, static_cast<std::int64_t>(row));
        }
      }
    }
    left += Pen::kLetterWidth_dots;
  }
}

}  // namespace

void Pen::Fill(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height) {
  for (std::int64_t row = y; row < y + height; ++row) {
    for (std::int64_t column = x; column < x + width; ++column) {
      if (row < 0 || column < 0 || row >= image_.height || column >= image_.width) continue;
      image_.at(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row)) = ink_;
    }
  }
}

void Pen::Write(std::string_view text, std::int64_t x, std::int64_t y, std::int64_t dot_px) {
  ForEachDot(text, [&](std::int64_t column, std::int64_t row) {
    Fill(x + column * dot_px, y + row * dot_px, dot_px, dot_px);
  });
}

void Pen::WriteUpwards(std::string_view text, std::int64_t x, std::int64_t y, std::int64_t dot_px) {
  ForEachDot(text, [&](std::int64_t column, std::int64_t row) {
    Fill(x + row * dot_px, y - column * dot_px, dot_px, dot_px);
  });
}

}  // namespace atlas
