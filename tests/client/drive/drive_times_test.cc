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

TEST(DriveTimesTest, OneThatIsWrongIsLeftOut) {
  EXPECT_EQ(Times({{0, 0.0}, {1, 0.1}, {2, 9.0}, {3, 0.3}, {4, 0.4}}),
            (Known{0.0, 0.1, std::nullopt, 0.3, 0.4}))
      << "too late";
  EXPECT_EQ(Times({{0, 0.0}, {1, 0.1}, {2, 0.05}, {3, 0.3}, {4, 0.4}}),
            (Known{0.0, std::nullopt, 0.05, 0.3, 0.4}))
      << "one of two, nobody knows which";
  EXPECT_EQ(Times({{0, 7.0}, {1, 0.1}, {2, 0.2}}), (Known{std::nullopt, 0.1, 0.2})) << "the first";
}

TEST(DriveTimesTest, OfEqualOnesOneIsKept) {
  int known = 0;
  for (const auto& time : Times({{0, 1.0}, {1, 1.0}, {2, 1.0}})) known += time ? 1 : 0;
  EXPECT_EQ(known, 1);
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
