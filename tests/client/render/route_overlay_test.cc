// A route's pixels: where they are, and none beyond the picture.
#include "client/render/route_overlay.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

namespace atlas {
namespace {

Image Blank() {
  Image image;
  image.width = 60;
  image.height = 40;
  image.pixels.resize(std::size_t{60} * 40);
  return image;
}

TEST(RouteOverlayTest, LinesLieWhereTheMapHasTheirPlaces) {
  Image image = Blank();
  // Pixels of 0.5 m; the map's corner is (10 m, 20 m), its picture begins 5 pixels from the edges.
  DrawRoute({{12.0, 24.0, 0.0}, {32.0, 24.0, 0.0}}, {20, 40, 69, 69}, 0.5, 5, image);
  const auto is_drawn = [&](std::uint32_t x, std::uint32_t y) {
    return image.at(x, y) != Rgb{};
  };
  EXPECT_TRUE(is_drawn(30, 27));  // (22.5 m, 24 m): row 69 - 48 + 5
  EXPECT_FALSE(is_drawn(30, 35));
  EXPECT_FALSE(is_drawn(30, 15));
  EXPECT_NE(image.at(9, 27), image.at(49, 27));  // start and goal have colours of their own
}

TEST(RouteOverlayTest, WhatLiesBeyondThePictureIsLeftOut) {
  Image image = Blank();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  DrawRoute({{1e9, 0.0, 0.0}, {nan, 0.0, 0.0}, {-1e300, 1e300, 0.0}}, {0, 0, 49, 29}, 0.5, 5,
            image);
  EXPECT_TRUE(std::all_of(image.pixels.begin(), image.pixels.end(),
                          [](const Rgb& pixel) { return pixel == Rgb{}; }));
  DrawRoute({}, {0, 0, 49, 29}, 0.5, 5, image);
  DrawRoute({{-2.0, -2.0, 0.0}, {40.0, 40.0, 0.0}}, {0, 0, 49, 29}, 0.5, 5, image);  // half of it
}

}  // namespace
}  // namespace atlas
