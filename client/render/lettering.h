// Text in a picture: small letters of dots, and the pen that writes them.
#pragma once

#include <cstdint>
#include <string_view>

#include "client/render/image.h"

namespace atlas {

// Letters are 3 x 5 dots and a dot apart. Known are 0-9, a-z and . - + , ( ) / : % = # _; capitals
// are written small, all else is a gap.
class Pen {
 public:
  static constexpr std::int64_t kLetterWidth_dots = 4;  // the gap counted
  static constexpr std::int64_t kLetterHeight_dots = 5;

  Pen(Image& image, Rgb ink) : image_(image), ink_(ink) {}

  // Pixels outside of the picture are left out.
  void Fill(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height);
  // From (x, y), the first letter's upper left corner, to the right; a dot is dot_px wide.
  void Write(std::string_view text, std::int64_t x, std::int64_t y, std::int64_t dot_px);
  // The same upwards: (x, y) is the first letter's lower left corner, turned.
  void WriteUpwards(std::string_view text, std::int64_t x, std::int64_t y, std::int64_t dot_px);

 private:
  Image& image_;
  Rgb ink_;
};

}  // namespace atlas
