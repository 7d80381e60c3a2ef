// What is said of drives that were not, or not surely, localized.
#include "client/cli/commands/drive/localization_text.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace atlas {
namespace {

// Of so many scans, of which these were found right, these were lost, and the others were off.
DriveLocalizationReport Localized(int scans, int right, int lost) {
  DriveLocalizationReport report;
  report.scans = static_cast<std::uint64_t>(scans);
  for (int i = 0; i < scans; ++i) {
    report.score.Add(
        i < right ? PoseError{.translation_m = 0.02} : PoseError{.translation_m = 30.0},
        i >= scans - lost);
  }
  return report;
}

bool Says(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

std::string NoteOf(const DriveLocalizationReport& report, bool is_tracked) {
  std::ostringstream err;
  NoteLost(report, is_tracked, err);
  return err.str();
}

TEST(LocalizationTextTest, OfUnreadableScansThoseThatWereLocalizedAreToldWhereThereAreSome) {
  const UnreadableScan damaged{3, {StatusCode::kInvalidData, "000003.bin: 7 bytes"}};
  DriveLocalizationReport some = Localized(10, 8, 2);
  EXPECT_TRUE(CheckReadable(some).ok());
  some.unreadable.assign(2, damaged);
  EXPECT_EQ(CheckReadable(some).code(), StatusCode::kInvalidData);
  EXPECT_EQ(CheckReadable(some).message(),
            "2 scans could not be read, the first: 000003.bin: 7 bytes; of all 10 scans 2 failed "
            "with that, of the others the error is 0.020 m RMSE");
  DriveLocalizationReport none = Localized(4, 0, 4);
  none.unreadable.assign(1, damaged);
  EXPECT_EQ(CheckReadable(none).message(),
            "1 scan could not be read, the first: 000003.bin: 7 bytes; none of all 4 scans was "
            "localized");
}

TEST(LocalizationTextTest, ADriveThatIsLostOrNowhereGoodIsNotedAndNoOther) {
  EXPECT_TRUE(Says(NoteOf(Localized(4, 0, 4), true), "all are lost"));
  DriveLocalizationReport weak = Localized(4, 2, 1);
  EXPECT_TRUE(Says(NoteOf(weak, true), "none of 4 scans is good"));
  EXPECT_EQ(NoteOf(weak, false), "");
  weak.good = 1;
  EXPECT_EQ(NoteOf(weak, true), "");
  EXPECT_EQ(NoteOf(DriveLocalizationReport(), true), "");
}

}  // namespace
}  // namespace atlas
