// Health along drives of few scans.
#include "client/cli/commands/drive/health_strip.h"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

using Health = LocalizationHealth;

std::vector<LocalizedScan> Scans(const std::vector<std::pair<std::uint32_t, Health>>& numbered) {
  std::vector<LocalizedScan> scans;
  for (const auto& [number, health] : numbered) {
    LocalizedScan& scan = scans.emplace_back();
    scan.scan = number;
    scan.located.health = health;
  }
  return scans;
}

TEST(HealthStripTest, ScansInARowOfTheSameHealthAreOnePart) {
  const PlotStrip strip = HealthStrip(Scans({{10, Health::kGood},
                                             {12, Health::kGood},
                                             {14, Health::kLost},
                                             {16, Health::kWeak},
                                             {18, Health::kGood}}));
  ASSERT_EQ(strip.states.size(), 3U);
  EXPECT_EQ(strip.states[0].name, "good");
  EXPECT_EQ(strip.states[1].name, "weak");
  EXPECT_EQ(strip.states[2].name, "lost");
  ASSERT_EQ(strip.parts.size(), 4U);
  EXPECT_DOUBLE_EQ(strip.parts[0].from, 9.0);
  EXPECT_DOUBLE_EQ(strip.parts[0].to, 13.0);
  EXPECT_EQ(strip.parts[0].state, 0U);
  EXPECT_EQ(strip.parts[1].state, 2U);
  EXPECT_EQ(strip.parts[2].state, 1U);
  EXPECT_DOUBLE_EQ(strip.parts[3].to, 19.0);
}

TEST(HealthStripTest, WhereScansAreLeftOutThereIsNothing) {
  const PlotStrip strip =
      HealthStrip(Scans({{0, Health::kGood}, {1, Health::kGood}, {9, Health::kGood}}));
  ASSERT_EQ(strip.parts.size(), 2U);
  EXPECT_DOUBLE_EQ(strip.parts[0].to, 1.5);
  EXPECT_DOUBLE_EQ(strip.parts[1].from, 8.5);
  EXPECT_TRUE(HealthStrip({}).parts.empty());
}

TEST(HealthStripTest, ShotsOfAScanOverlap) {
  const PlotStrip strip =
      HealthStrip(Scans({{5, Health::kGood}, {5, Health::kLost}, {5, Health::kGood}}));
  ASSERT_EQ(strip.parts.size(), 3U);
  EXPECT_DOUBLE_EQ(strip.parts[1].from, 4.5);
  EXPECT_DOUBLE_EQ(strip.parts[1].to, 5.5);
}

}  // namespace
}  // namespace atlas
