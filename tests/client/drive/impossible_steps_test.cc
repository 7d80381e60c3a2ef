#include "client/drive/impossible_steps.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

// Scans 0.1 s apart at these places along x.
DriveFolder Along(const std::vector<double>& x_m) {
  DriveFolder drive;
  for (const double x : x_m) {
    DriveScan scan;
    scan.number = static_cast<std::uint32_t>(drive.scans.size());
    scan.T_world_sensor.translation().x() = x;
    scan.time_s = 0.1 * scan.number;
    drive.scans.push_back(scan);
  }
  return drive;
}

std::vector<SelectedScan> Selected(const DriveFolder& drive, const SelectionOptions& options = {}) {
  auto selected = SelectScans(drive, options);
  JoinImpossibleParts(drive, selected);
  return selected;
}

std::vector<std::uint32_t> Parts(const std::vector<SelectedScan>& selected) {
  std::vector<std::uint32_t> parts;
  parts.reserve(selected.size());
  for (const SelectedScan& scan : selected) {
    parts.push_back(scan.session_part);
  }
  return parts;
}

using Numbers = std::vector<std::uint32_t>;
using Reasons = std::vector<std::string>;

TEST(ImpossibleStepsTest, AWildPoseStaysInItsSession) {
  const DriveFolder drive = Along({0, 1, 2, 5'000, 4, 5});
  const auto selected = Selected(drive);
  EXPECT_EQ(Parts(selected), (Numbers{1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(FindImpossibleSteps(drive, selected),
            (Reasons{"keyframe 2 to 3: 4998 m in 0.10 s, at most 90 m/s and 50 m",
                     "keyframe 3 to 4: 4996 m in 0.10 s, at most 90 m/s and 50 m"}));
}

TEST(ImpossibleStepsTest, AStepThatIsPossibleInItsTimeStartsAnotherSession) {
  DriveFolder drive = Along({0, 1, 208, 209, 5'000, 5'001});
  for (std::size_t i = 2; i < drive.scans.size(); ++i) {
    *drive.scans[i].time_s += 10.0;
  }
  const auto selected = Selected(drive);
  EXPECT_EQ(Parts(selected), (Numbers{1, 1, 2, 2, 2, 2}));
  EXPECT_EQ(FindImpossibleSteps(drive, selected),
            (Reasons{"keyframe 3 to 4: 4791 m in 0.10 s, at most 90 m/s and 50 m"}));
  EXPECT_EQ(Parts(Selected(drive, {.begin = 5})), Numbers{2}) << "whatever is selected";
}

TEST(ImpossibleStepsTest, StepsThatAreImpossibleTogetherStartNone) {
  const DriveFolder zigzag = Along({0, 45, 0, 45, 0, 45});
  const auto selected = Selected(zigzag);
  EXPECT_EQ(Parts(selected), (Numbers{1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(FindImpossibleSteps(zigzag, selected).size(), 2U);
  const auto every_second = Selected(zigzag, {.parity = ScanParity::kEven});
  EXPECT_EQ(FindImpossibleSteps(zigzag, every_second), Reasons{}) << "the daemon sees no zigzag";
}

DriveFolder Untimed(const std::vector<double>& x_m) {
  DriveFolder drive = Along(x_m);
  for (DriveScan& scan : drive.scans) {
    scan.time_s.reset();
  }
  return drive;
}

TEST(ImpossibleStepsTest, WithoutTimesWildPosesStayInTheirSession) {
  const DriveFolder one = Untimed({0, 1, 2, 5'000, 4, 5});
  EXPECT_EQ(Parts(Selected(one)), (Numbers{1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(FindImpossibleSteps(one, Selected(one)).size(), 2U);
  const DriveFolder several = Untimed({0, 1, 2, 900, -900, -901, 6, 7, 300, 9});
  EXPECT_EQ(Parts(Selected(several)), (Numbers{1, 1, 1, 1, 1, 1, 1, 1, 1, 1}));
}

TEST(ImpossibleStepsTest, WithoutTimesADriveThatIsAwayForLongIsAnother) {
  const DriveFolder away = Untimed({0, 1, 500, 501, 502, 503, 504, 505, 506, 507, 508, 2, 3});
  EXPECT_EQ(Parts(Selected(away)), (Numbers{1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3, 3}));
  const DriveFolder elsewhere = Untimed({0, 1, 500, 501, 60, 61});
  EXPECT_EQ(Parts(Selected(elsewhere)), (Numbers{1, 1, 2, 2, 3, 3}));
}

TEST(ImpossibleStepsTest, WithoutTimesOtherJumpsStartAnotherSession) {
  const DriveFolder drive = Untimed({0, 1, 208, 209});
  const auto selected = Selected(drive);
  EXPECT_EQ(Parts(selected), (Numbers{1, 1, 2, 2}));
  EXPECT_EQ(FindImpossibleSteps(drive, selected), Reasons{});
}

}  // namespace
}  // namespace atlas
