#include "client/drive/drive_times.h"

#include <optional>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

struct Scan {
  std::uint32_t number;
  std::optional<double> time_s;
};

DriveFolder DriveOf(const std::vector<Scan>& scans) {
  DriveFolder drive;
  for (const Scan& scan : scans) {
    DriveScan made;
    made.number = scan.number;
    made.time_s = scan.time_s;
    drive.scans.push_back(made);
  }
  return drive;
}

std::vector<std::optional<double>> Times(const std::vector<Scan>& scans) {
  std::vector<SelectedScan> selected;
  for (std::size_t i = 0; i < scans.size(); ++i) selected.push_back({i, 1});
  return TimesOf(DriveOf(scans), selected);
}

using Known = std::vector<std::optional<double>>;

TEST(DriveTimesTest, TimesThatGoOnAreTaken) {
  EXPECT_EQ(Times({{0, 5.0}, {1, 5.1}, {2, 5.3}}), (Known{5.0, 5.1, 5.3}));
  EXPECT_EQ(Times({}), Known{});
}

void ExpectTimes(const std::vector<Scan>& scans, const Known& expected) {
  const Known times = Times(scans);
  ASSERT_EQ(times.size(), expected.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    ASSERT_EQ(times[i].has_value(), expected[i].has_value()) << i;
    if (times[i]) {
      EXPECT_NEAR(*times[i], *expected[i], 1e-9) << i;
    }
  }
}

TEST(DriveTimesTest, OneThatIsWrongIsTakenBetweenItsNeighbours) {
  ExpectTimes({{0, 0.0}, {1, 0.1}, {2, 9.0}, {3, 0.3}, {4, 0.4}}, {0.0, 0.1, 0.2, 0.3, 0.4});
  ExpectTimes({{0, 0.0}, {1, 0.1}, {2, 0.02}, {3, 0.3}, {4, 0.4}}, {0.0, 0.1, 0.2, 0.3, 0.4});
  ExpectTimes({{0, 0.0}, {1, 0.1}, {2, 0.35}, {3, 0.3}, {4, 0.4}}, {0.0, 0.1, 0.2, 0.3, 0.4});
}

TEST(DriveTimesTest, AtAnEndItIsNotKnown) {
  ExpectTimes({{0, 7.0}, {1, 0.1}, {2, 0.2}}, {std::nullopt, 0.1, 0.2});
  ExpectTimes({{0, 0.1}, {1, 0.1}}, {0.1, std::nullopt});
}

TEST(DriveTimesTest, AStampThatIsRepeatedWasRightAtFirst) {
  ExpectTimes({{0, 0.0}, {1, 0.1}, {2, 0.1}, {3, 0.3}}, {0.0, 0.1, 0.2, 0.3});
  ExpectTimes({{0, 0.0}, {1, 0.1}, {6, 0.1}, {7, 0.7}}, {0.0, 0.1, 0.6, 0.7});
}

TEST(DriveTimesTest, AClockThatWasSetBackIsRightBeforeAndBehind) {
  EXPECT_EQ(Times({{0, 50.0}, {1, 50.1}, {2, 50.2}, {3, 0.0}, {4, 0.1}, {5, 0.2}, {6, 0.3}}),
            (Known{50.0, 50.1, 50.2, 0.0, 0.1, 0.2, 0.3}));
}

TEST(DriveTimesTest, CoarseTimesAreFilledIn) {
  std::vector<Scan> scans;
  for (std::uint32_t i = 0; i < 20; ++i) scans.push_back({i, i / 4});
  const Known times = Times(scans);
  EXPECT_NEAR(UsualIntervalOf(times).value(), 0.25, 0.02);
  for (std::size_t i = 4; i < 19; ++i) EXPECT_GT(times[i], times[i - 1]) << i;
}

TEST(DriveTimesTest, WithoutTimesNumbersTellWhatIsMissing) {
  EXPECT_EQ(Times({{4, std::nullopt}, {5, std::nullopt}, {9, std::nullopt}}),
            (Known{4.0, 5.0, 9.0}));
  EXPECT_EQ(Times({{0, 0.0}, {1, std::nullopt}, {3, 0.3}}), (Known{0.0, 1.0, 3.0}))
      << "not all of them are timed";
}

TEST(DriveTimesTest, TheUsualIntervalIsOneBetweenScansThatFollowEachOther) {
  EXPECT_EQ(UsualIntervalOf({}), std::nullopt);
  EXPECT_EQ(UsualIntervalOf({1.0, std::nullopt, 3.0}), std::nullopt);
  EXPECT_DOUBLE_EQ(UsualIntervalOf({1.0, 1.5, std::nullopt, 2.5, 3.0, 6.0}).value(), 0.5);
}

}  // namespace
}  // namespace atlas
