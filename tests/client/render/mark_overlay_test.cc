// Squares' pixels: where they are, and none beyond the picture.
#include "client/render/mark_overlay.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr Rgb kRed{255, 0, 0};

Image Blank() {
  Image image;
  image.width = 60;
  image.height = 40;
  image.pixels.resize(std::size_t{60} * 40);
  return image;
}

std::size_t Drawn(const Image& image) {
  return static_cast<std::size_t>(std::count(image.pixels.begin(), image.pixels.end(), kRed));
}

TEST(MarkOverlayTest, SquaresLieWhereTheMapHasTheirPlaces) {
  Image image = Blank();
  // Pixels of 0.5 m; the map's corner is (10 m, 20 m), its picture begins 5 pixels from the edges.
  DrawMarks({{{22.25, 24.25}, 2.5, kRed}}, {20, 40, 69, 69}, 0.5, 5, image);
  EXPECT_EQ(Drawn(image), 25U);
  for (const std::uint32_t x : {27U, 31U}) {
    for (const std::uint32_t y : {24U, 28U}) EXPECT_EQ(image.at(x, y), kRed) << x << ' ' << y;
  }
}

TEST(MarkOverlayTest, SmallOnesAreSeen) {
  Image image = Blank();
  DrawMarks({{{22.25, 24.25}, 0.1, kRed}}, {20, 40, 69, 69}, 0.5, 5, image);
  EXPECT_EQ(Drawn(image), 9U);
}

TEST(MarkOverlayTest, WhatLiesBeyondThePictureIsLeftOut) {
  Image image = Blank();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  DrawMarks({{{1e9, 0.0}, 1.0, kRed},
             {{nan, 0.0}, 1.0, kRed},
             {{-1e300, 1e300}, 1.0, kRed},
             {{200.0, 200.0}, 1.0, kRed}},
            {0, 0, 49, 29}, 0.5, 5, image);
  EXPECT_EQ(Drawn(image), 0U);
  DrawMarks({{{0.0, 0.0}, 1e6, kRed}}, {0, 0, 49, 29}, 0.5, 5, image);
  EXPECT_EQ(Drawn(image), image.pixels.size());
}

}  // namespace
}  // namespace atlas
