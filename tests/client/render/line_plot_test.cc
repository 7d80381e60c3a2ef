// Plots looked at pixel by pixel and line by line.
#include "client/render/plot/line_plot.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "client/render/lettering.h"

namespace atlas {
namespace {

constexpr Rgb kRed{200, 10, 20};
constexpr Rgb kBlue{10, 20, 200};

std::size_t Count(const Image& image, const Rgb& color) {
  return static_cast<std::size_t>(std::count(image.pixels.begin(), image.pixels.end(), color));
}

std::size_t CountText(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

LinePlot Rising() {
  LinePlot plot;
  plot.title = "a <b> & c";
  plot.x_label = "scan";
  plot.panels = {{"error, m", {{"along", kRed, {{0, 0}, {50, 1}, {100, 2}}}}}};
  return plot;
}

// The first pixel of a colour in a column of the picture, from the top; -1 without one.
int TopOf(const Image& image, std::uint32_t x, const Rgb& color) {
  for (std::uint32_t y = 56; y < image.height; ++y) {  // below title and legend
    if (image.at(x, y) == color) return static_cast<int>(y);
  }
  return -1;
}

TEST(LinePlotTest, CurvesRiseFromLeftToRight) {
  const Image image = DrawPlot(Rising());
  const int left = TopOf(image, 100, kRed);
  const int middle = TopOf(image, 480, kRed);
  const int right = TopOf(image, 870, kRed);
  EXPECT_GT(left, middle);
  EXPECT_GT(middle, right);
  EXPECT_GT(right, 0);
}

TEST(LinePlotTest, WhatIsNotFiniteInterrupts) {
  LinePlot plot = Rising();
  plot.panels[0].curves[0].points = {{0, 0}, {30, 0.5}, {50, std::nan("")}, {70, 1.5}, {100, 2}};
  const Image image = DrawPlot(plot);
  EXPECT_GT(TopOf(image, 150, kRed), 0);
  EXPECT_EQ(TopOf(image, 480, kRed), -1);
  EXPECT_GT(TopOf(image, 850, kRed), 0);
}

TEST(LinePlotTest, MarksFlagsAndEmptyPanelsAreDrawn) {
  LinePlot plot = Rising();
  const std::size_t height = DrawPlot(plot).height;
  plot.panels.push_back({"yaw, deg", {{"yaw", kBlue, {}}}});
  plot.marks = {40};
  plot.flags = {60, 61};
  const std::string svg = PlotSvg(plot);
  EXPECT_NE(svg.find(">restart</text>"), std::string::npos);
  EXPECT_NE(svg.find(">failed</text>"), std::string::npos);
  const std::string flag = "stroke=\"#d62728\"";
  EXPECT_EQ(CountText(svg, flag), 4U);  // two in each panel
  EXPECT_EQ(DrawPlot(plot).height, height + 200);
  EXPECT_GT(Count(DrawPlot(plot), kBlue), 0U);  // its legend
  EXPECT_GT(DrawPlot(LinePlot()).height, 0U);
}

TEST(LinePlotTest, AStripShowsStatesAboveThePanels) {
  constexpr Rgb kFine{1, 200, 2};
  constexpr Rgb kBad{200, 3, 200};
  LinePlot plot = Rising();
  const std::uint32_t height = DrawPlot(plot).height;
  plot.strip = {"health",
                {{"fine", kFine}, {"bad", kBad}},
                {{-0.5, 50.0, 0}, {49.9, 50.1, 1}, {50.0, 100.5, 0}}};
  const Image image = DrawPlot(plot);
  EXPECT_EQ(image.height, height + 48);
  const auto column = [&image](std::uint32_t x, const Rgb& color) {
    std::size_t count = 0;
    for (std::uint32_t y = 60; y < 80; ++y) count += image.at(x, y) == color ? 1U : 0U;
    return count;
  };
  EXPECT_EQ(column(95, kFine), 9U);
  EXPECT_EQ(column(95, kBad), 0U);
  EXPECT_EQ(column(878, kFine), 9U);
  EXPECT_EQ(column(485, kBad), 18U) << "a single scan is seen, and not painted over";
  EXPECT_EQ(column(470, kBad), 0U);
  EXPECT_EQ(column(87, kFine), 0U) << "nothing left of the axis";
  EXPECT_GT(TopOf(image, 870, kRed), 78) << "the curve is below it";
  const std::string svg = PlotSvg(plot);
  EXPECT_EQ(CountText(svg, "fill=\"#c803c8\""), 2U);  // its part and the legend
  EXPECT_NE(svg.find(">health</text>"), std::string::npos);
}

TEST(LinePlotTest, SvgIsTheSameInText) {
  const std::string svg = PlotSvg(Rising());
  EXPECT_TRUE(svg.starts_with("<svg "));
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
  EXPECT_NE(svg.find("a &lt;b> &amp; c"), std::string::npos);
  EXPECT_NE(svg.find(">along</text>"), std::string::npos);
  EXPECT_EQ(CountText(svg, "stroke=\"#c80a14\""), 4U);  // three points and the legend
  EXPECT_EQ(PlotSvg(Rising()), svg);
}

TEST(LinePlotTest, LevelCurvesHaveRoomToEitherSide) {
  LinePlot plot = Rising();
  plot.panels[0].curves[0].points = {{7, 3}, {7, 3}};
  const Image image = DrawPlot(plot);
  EXPECT_GT(Count(image, kRed), 0U);
}

TEST(LetteringTest, TextIsDotsAndItsTurnIsTheSameTurned) {
  Image level{40, 40, std::vector<Rgb>(1600)};
  Image upright = level;
  Pen(level, kRed).Write("T1", 3, 4, 1);
  Pen(upright, kRed).WriteUpwards("T1", 3, 35, 1);
  EXPECT_EQ(level.at(3, 4), kRed);   // the bar of the T
  EXPECT_EQ(level.at(3, 5), Rgb());  // below it, beside the stem
  EXPECT_EQ(Count(level, kRed), 15U);
  for (std::uint32_t i = 0; i < 8; ++i) {
    for (std::uint32_t j = 0; j < 5; ++j) {
      EXPECT_EQ(level.at(3 + i, 4 + j), upright.at(3 + j, 35 - i));
    }
  }
}

TEST(LetteringTest, PixelsOutsideAreLeftOut) {
  Image image{4, 4, std::vector<Rgb>(16)};
  Pen(image, kRed).Write("888", -2, -2, 2);
  EXPECT_LE(Count(image, kRed), 16U);
}

}  // namespace
}  // namespace atlas
