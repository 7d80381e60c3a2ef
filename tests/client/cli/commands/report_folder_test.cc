#include "client/cli/commands/merge/report_folder.h"

#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <boost/json/parse.hpp>
#include <gtest/gtest.h>

#include "client/cli/commands/merge/serve_log.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

class ReportFolderTest : public ::testing::Test {
 protected:
  ReportFolder Open(std::size_t kept) {
    auto reports = ReportFolder::Open(path(), kept);
    EXPECT_TRUE(reports.has_value()) << reports.error().message();
    return *std::move(reports);
  }
  std::filesystem::path path() const { return folder_.path() / "some" / "reports"; }
  std::set<std::string> Files() const {
    std::set<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(path())) {
      files.insert(entry.path().filename().string());
    }
    return files;
  }
  void Touch(const std::string& name) const { std::ofstream(path() / name) << "x"; }

  TestFolder folder_;
};

TEST_F(ReportFolderTest, AReportIsAFileOfJsonAPictureAndCorrections) {
  ReportFolder reports = Open(10);
  const auto file = reports.Write("batch-1", {}, {{"applied", true}}, false);
  ASSERT_TRUE(file.has_value()) << file.error().message();
  EXPECT_EQ(file->parent_path(), path());
  EXPECT_TRUE(file->filename().string().starts_with("merge-2"));
  EXPECT_TRUE(file->filename().string().ends_with("Z-batch-1.json"));
  std::stringstream text;
  text << std::ifstream(*file).rdbuf();
  EXPECT_EQ(text.str(), "{\"applied\":true}\n");
  EXPECT_EQ(Files().size(), 2U);
  ASSERT_TRUE(reports.Write("over-limits", {}, {}, true).has_value());
  EXPECT_EQ(Files().size(), 5U);
}

TEST_F(ReportFolderTest, TheNewestAreKeptAndWhatIsNoReportIsNotTouched) {
  Open(10);
  for (const char* const name :
       {"merge-20250101T000000000Z-batch-1.json", "merge-20250101T000000000Z-batch-1.png",
        "merge-20250102T000000000Z-over-limits.json.partial",
        "merge-20250103T000000000Z-batch-2.json", "merge-notes.txt", "merge-20250101.json",
        "other"}) {
    Touch(name);
  }
  ReportFolder reports = Open(2);
  EXPECT_EQ(Files(), (std::set<std::string>{"merge-20250102T000000000Z-over-limits.json.partial",
                                            "merge-20250103T000000000Z-batch-2.json",
                                            "merge-notes.txt", "merge-20250101.json", "other"}));
  ASSERT_TRUE(reports.Write("batch-3", {}, {}, false).has_value());
  const std::set<std::string> files = Files();
  EXPECT_EQ(files.size(), 6U);
  EXPECT_TRUE(files.contains("merge-20250103T000000000Z-batch-2.json"));
}

TEST_F(ReportFolderTest, AFolderOfNoUseIsAnError) {
  std::ofstream(folder_.path() / "some") << "a file";
  const auto reports = ReportFolder::Open(path(), 2);
  ASSERT_FALSE(reports.has_value());
  EXPECT_EQ(reports.error().code(), StatusCode::kConflict) << reports.error().message();
}

TEST_F(ReportFolderTest, AFolderThatWentIsAnErrorOfTheReport) {
  ReportFolder reports = Open(2);
  std::filesystem::remove_all(path());
  const auto file = reports.Write("batch-1", {}, {}, false);
  ASSERT_FALSE(file.has_value());
  EXPECT_EQ(file.error().code(), StatusCode::kNotFound) << file.error().message();
}

TEST(ServeLogTest, ALineIsForPeopleOrForPrograms) {
  std::ostringstream text;
  ServeLog(text, "atlas-merge", false)
      .Line(ServeLogLevel::kWarning, "lost\nit", {{"event", "lost"}});
  EXPECT_NE(text.str().find("] [atlas-merge] [warning] lost?it\n"), std::string::npos)
      << text.str();
  EXPECT_EQ(text.str().find("[2"), 0U);
  std::ostringstream json;
  ServeLog(json, "atlas-merge", true).Line(ServeLogLevel::kInfo, "lost\nit", {{"event", "lost"}});
  const auto line = boost::json::parse(json.str()).as_object();
  EXPECT_EQ(line.at("level").as_string(), "info");
  EXPECT_EQ(line.at("message").as_string(), "lost\nit");
  EXPECT_EQ(line.at("event").as_string(), "lost");
  EXPECT_EQ(line.at("time").as_string().size(), std::string("2026-11-27T03:12:51.123Z").size());
}

}  // namespace
}  // namespace atlas
