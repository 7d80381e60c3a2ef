// Files of surveys by themselves: which are believed, and which go.
#include "server/service/fusion/survey_files.h"

#include <chrono>
#include <cstdint>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/service/directory_files.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

class SurveyFilesTest : public ::testing::Test {
 protected:
  SurveyFilesTest() {
    survey_files_.directory = directory_ / "surveys";
    survey_files_.min_free_bytes = 0;
  }
  ~SurveyFilesTest() override {
    std::error_code ignored;
    fs::remove_all(directory_, ignored);
  }

  fs::path directory_ = NewDirectory();
  SurveyFilesOptions survey_files_;
};

void WaitUntilSorted(const SurveyFiles& files) {
  while (!files.is_sorted()) {
    std::this_thread::yield();
  }
}

// Files of its own in a directory, without a service.
class FilesAlone {
 public:
  FilesAlone(const SurveyFilesOptions& options, const Result<AtlasLine>& line)
      : files_(
            options,
            MapProfile(),
            [line] { return line; },
            [this](LogLevel, const std::string& text) { lines_.push_back(text); }) {
    WaitUntilSorted(files_);
  }

  bool Write(const TileId& id, std::uint64_t revision) {
    return files_.Write({TileSurveys(id), revision});
  }
  bool Has(const TileId& id) { return files_.Read(id).has_value(); }
  SurveyFiles& files() { return files_; }
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  std::vector<std::string> lines_;
  SurveyFiles files_;
};

AtlasStart Start(std::uint8_t number, std::uint64_t revision) {
  AtlasStart start;
  start.id.fill(number);
  start.revision = revision;
  return start;
}

constexpr TileId kTile{0, 3, -4};
const AtlasLine kLine{{Start(1, 0)}, 9};

TEST_F(SurveyFilesTest, AFileIsBelievedWhileTheAtlasGoesOnFromIt) {
  {
    FilesAlone files(survey_files_, kLine);
    EXPECT_TRUE(files.Write(kTile, 7));
    EXPECT_TRUE(files.Has(kTile));
    EXPECT_FALSE(files.Has({0, 3, -5}));
  }
  const auto is_believed = [&](const AtlasLine& line) {
    const fs::path saved = directory_ / "saved";
    fs::remove_all(saved);
    fs::copy(survey_files_.directory, saved);
    FilesAlone files(survey_files_, line);
    const bool stays = !FilesIn(survey_files_.directory).empty();
    const bool has = files.Has(kTile);
    EXPECT_EQ(has, stays) << "others are removed";
    fs::remove_all(survey_files_.directory);
    fs::copy(saved, survey_files_.directory);
    return has;
  };
  EXPECT_TRUE(is_believed({{Start(1, 0)}, 7}));
  EXPECT_TRUE(is_believed({{Start(1, 0), Start(2, 7)}, 8}));
  EXPECT_TRUE(is_believed({{Start(1, 0), Start(2, 9), Start(3, 9)}, 10}));
  EXPECT_FALSE(is_believed({{Start(1, 0)}, 6})) << "a copy of before was put back";
  EXPECT_FALSE(is_believed({{Start(1, 0), Start(2, 6)}, 9})) << "and has changed since";
  EXPECT_FALSE(is_believed({{Start(2, 0), Start(3, 9)}, 9})) << "another atlas, or so long ago";
  EXPECT_FALSE(is_believed({}));
}

TEST_F(SurveyFilesTest, NoRoomIsMadeForAFileThatGrew) {
  FilesAlone files(survey_files_, kLine);
  ASSERT_TRUE(files.Write(kTile, 7));
  const fs::path path = FilesIn(survey_files_.directory).front();
  fs::resize_file(path, std::uintmax_t{1} << 40);  // nothing but a hole
  EXPECT_FALSE(files.Has(kTile));
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(SurveyFilesTest, AFileUnderAnothersNameIsNotBelieved) {
  const TileId other{0, 3, -5};
  FilesAlone files(survey_files_, kLine);
  ASSERT_TRUE(files.Write(kTile, 7));
  const fs::path path = FilesIn(survey_files_.directory).front();
  const std::string bytes = Contents(path);
  ASSERT_TRUE(files.Write(other, 7));
  for (const fs::path& file : FilesIn(survey_files_.directory)) {
    Overwrite(file, bytes);
  }
  EXPECT_TRUE(files.Has(kTile));
  EXPECT_FALSE(files.Has(other));
}

TEST_F(SurveyFilesTest, TheLeastRecentlyUsedGoFirst) {
  std::size_t file_bytes = 0;
  {
    FilesAlone files(survey_files_, kLine);
    ASSERT_TRUE(files.Write(kTile, 7));
    file_bytes = files.files().bytes();
  }
  fs::remove_all(survey_files_.directory);
  survey_files_.max_bytes = 3 * file_bytes + file_bytes / 2;
  FilesAlone files(survey_files_, kLine);
  for (std::int32_t x = 0; x < 3; ++x) {
    ASSERT_TRUE(files.Write({0, x, 0}, 7));
  }
  EXPECT_TRUE(files.Has({0, 0, 0}));
  ASSERT_TRUE(files.Write({0, 3, 0}, 7));
  EXPECT_TRUE(files.Has({0, 0, 0}));
  EXPECT_FALSE(files.Has({0, 1, 0}));
  EXPECT_LE(files.files().bytes(), survey_files_.max_bytes);
  EXPECT_EQ(FilesIn(survey_files_.directory).size(), 3u);
}

TEST_F(SurveyFilesTest, TheLeastRecentlyUsedGoFirstAfterARestart) {
  {
    FilesAlone files(survey_files_, kLine);
    for (std::int32_t x = 0; x < 3; ++x) {
      ASSERT_TRUE(files.Write({0, x, 0}, 7));
    }
    for (const fs::path& path : FilesIn(survey_files_.directory)) {
      fs::last_write_time(path, fs::last_write_time(path) - std::chrono::hours(1));
    }
    ASSERT_TRUE(files.Has({0, 1, 0}));
    survey_files_.max_bytes = files.files().bytes() / 3;
  }
  FilesAlone files(survey_files_, kLine);
  EXPECT_TRUE(files.Has({0, 1, 0}));
  EXPECT_FALSE(files.Has({0, 2, 0}));
}

TEST_F(SurveyFilesTest, WhatIsThereIsKnown) {
  FilesAlone files(survey_files_, kLine);
  KeptSurveys kept{TileSurveys(kTile), 7};
  EXPECT_FALSE(files.files().Has(kept));
  EXPECT_TRUE(files.files().Write(kept));
  EXPECT_TRUE(files.files().Has(kept));
  kept.revision = 8;
  EXPECT_FALSE(files.files().Has(kept));
}

TEST_F(SurveyFilesTest, ADirectoryThatWasRemovedIsMadeAgain) {
  FilesAlone files(survey_files_, kLine);
  ASSERT_TRUE(files.Write(kTile, 7));
  fs::remove_all(survey_files_.directory);
  EXPECT_FALSE(files.Has(kTile));
  EXPECT_TRUE(files.Write(kTile, 8));
  EXPECT_TRUE(files.Has(kTile));
  EXPECT_TRUE(files.lines().empty());
}

TEST_F(SurveyFilesTest, WhoWantsNoneHasNone) {
  {
    FilesAlone files(survey_files_, kLine);
    ASSERT_TRUE(files.Write(kTile, 7));
  }
  Overwrite(survey_files_.directory / "letter.txt", "dear");
  survey_files_.max_bytes = 0;
  FilesAlone files(survey_files_, kLine);
  EXPECT_FALSE(files.files().is_on());
  EXPECT_EQ(FilesIn(survey_files_.directory).size(), 1u);
  EXPECT_FALSE(files.Write(kTile, 7));
  fs::remove_all(survey_files_.directory);
  EXPECT_TRUE(FilesAlone(survey_files_, kLine).lines().empty());
}

TEST_F(SurveyFilesTest, AnAtlasThatCannotBeReadIsTold) {
  FilesAlone files(survey_files_, Result<AtlasLine>(Error(StatusCode::kInvalidData, "bent")));
  EXPECT_FALSE(files.files().is_on());
  ASSERT_EQ(files.lines().size(), 1u);
  EXPECT_NE(files.lines()[0].find("bent"), std::string::npos);
}

// The same line as it is when the atlas has changed.
TEST_F(SurveyFilesTest, TheLineIsThatOfNow) {
  AtlasLine line = kLine;
  SurveyFiles files(
      survey_files_, MapProfile(), [&] { return Result<AtlasLine>(line); },
      [](LogLevel, const std::string& text) { ADD_FAILURE() << text; });
  WaitUntilSorted(files);  // which asks for the line, too
  ASSERT_TRUE(files.Write({TileSurveys(kTile), 9}));
  EXPECT_TRUE(files.Read(kTile).has_value());
  line = {{Start(1, 0), Start(2, 9)}, 10};
  EXPECT_TRUE(files.Read(kTile).has_value()) << "the atlas went on from it";
  ASSERT_TRUE(files.Write({TileSurveys(kTile), 10}));
  EXPECT_EQ(files.Read(kTile)->revision, 10u);
  line = {{Start(1, 0)}, 9};
  EXPECT_FALSE(files.Read(kTile).has_value());
}

// Thousands of files may be removed at the start, and what is written meanwhile stays.
TEST_F(SurveyFilesTest, WhatIsWrittenWhileOthersAreRemovedStays) {
  constexpr int kOld = 2'000;
  fs::create_directories(survey_files_.directory);
  for (int i = 0; i < kOld; ++i) {
    Overwrite(survey_files_.directory / (std::to_string(i) + ".survey"), "of a program before");
  }
  SurveyFiles files(
      survey_files_, MapProfile(), [] { return Result<AtlasLine>(kLine); },
      [](LogLevel, const std::string& text) { ADD_FAILURE() << text; });
  std::int32_t written = 0;
  for (; !files.is_sorted() || written < 10; ++written) {
    ASSERT_TRUE(files.Write({TileSurveys({0, written, 0}), 7}));
  }
  EXPECT_EQ(FilesIn(survey_files_.directory).size(), static_cast<std::size_t>(written));
  EXPECT_EQ(files.Read({0, 0, 0})->revision, 7u);
}

TEST_F(SurveyFilesTest, WhatIsOnDiskOfOthersStays) {
  fs::create_directories(survey_files_.directory);
  Overwrite(survey_files_.directory / "letter.txt", "dear");
  Overwrite(survey_files_.directory / "1.survey", "half");
  Overwrite(survey_files_.directory / "1.0.survey-new", "half");
  FilesAlone files(survey_files_, kLine);
  const auto left = FilesIn(survey_files_.directory);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left.front().filename(), "letter.txt");
}

TEST_F(SurveyFilesTest, OthersNeedAFullDiskMore) {
  survey_files_.min_free_bytes = ~std::uintmax_t{0};
  FilesAlone files(survey_files_, kLine);
  EXPECT_FALSE(files.Write(kTile, 7));
  EXPECT_TRUE(FilesIn(survey_files_.directory).empty());
  EXPECT_TRUE(files.lines().empty());
}

TEST_F(SurveyFilesTest, OthersGetTheRoomWhenTheyNeedIt) {
  {
    FilesAlone files(survey_files_, kLine);
    ASSERT_TRUE(files.Write(kTile, 7));
  }
  FilesAlone plenty(survey_files_, kLine);
  plenty.files().MakeRoom();
  EXPECT_TRUE(plenty.Has(kTile));
  survey_files_.min_free_bytes = ~std::uintmax_t{0};
  FilesAlone files(survey_files_, kLine);
  files.files().MakeRoom();
  EXPECT_TRUE(FilesIn(survey_files_.directory).empty());
  EXPECT_EQ(files.files().bytes(), 0u);
}

TEST_F(SurveyFilesTest, ADirectoryThatCannotBeMadeIsToldOnce) {
  Overwrite(survey_files_.directory, "a file");
  FilesAlone files(survey_files_, kLine);
  EXPECT_FALSE(files.files().is_on());
  EXPECT_FALSE(files.Write(kTile, 7));
  ASSERT_EQ(files.lines().size(), 1u);
  EXPECT_NE(files.lines()[0].find("surveys are not kept on disk: cannot make"), std::string::npos);
}

TEST_F(SurveyFilesTest, AWriteThatFailsIsToldOnceAMinute) {
  FilesAlone files(survey_files_, kLine);
  fs::remove_all(survey_files_.directory);
  Overwrite(survey_files_.directory, "a file");
  EXPECT_FALSE(files.Write(kTile, 7));
  EXPECT_FALSE(files.Write(kTile, 8));
  ASSERT_EQ(files.lines().size(), 1u);
  EXPECT_NE(files.lines()[0].find("Not a directory"), std::string::npos) << files.lines()[0];
}

}  // namespace
}  // namespace atlas
