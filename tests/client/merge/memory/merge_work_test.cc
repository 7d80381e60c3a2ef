// What was found is found again in the next run, by those who ask nearly the same, and by nobody
// else; whatever becomes of the folder, nothing else than what was kept comes out of it.
#include "client/merge/memory/merge_work.h"

#include <chrono>
#include <filesystem>
#include <memory>
#include <numbers>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "client/vehicle/stored_file.h"
#include "tests/client/vehicle/test_folder.h"
#include "tests/core/support/simulated_keyframes.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr ShapeTolerance kTolerance{0.005, 0.06 * kDegree};
constexpr std::uint64_t kMuch = 1ULL << 30U;

Pose At(double x_m, double yaw_rad = 0.0) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x_m;
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

MatchRecord MatchOf(const SubmapName& a, const SubmapName& b) {
  MatchRecord record{a, b, At(1.0), {}};
  SubmapMatch& match = record.match;
  match.T_a_b = At(1.1, 0.3);
  for (Eigen::Index i = 0; i < 36; ++i) match.information(i / 6, i % 6) = 1.0 + 0.5 * double(i);
  match.fit = 0.7;
  match.columns = 0.6;
  match.explained = 0.5;
  match.sigma_m = 0.01;
  match.apart_m = 0.02;
  match.apart_rad = 0.03;
  return record;
}

void ExpectSame(const SubmapMatch& one, const SubmapMatch& other) {
  EXPECT_EQ(one.T_a_b.matrix(), other.T_a_b.matrix());
  EXPECT_EQ(one.information, other.information);
  EXPECT_EQ(one.fit, other.fit);
  EXPECT_EQ(one.columns, other.columns);
  EXPECT_EQ(one.explained, other.explained);
  EXPECT_EQ(one.sigma_m, other.sigma_m);
  EXPECT_EQ(one.apart_m, other.apart_m);
  EXPECT_EQ(one.apart_rad, other.apart_rad);
}

class MergeWorkTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::DrivenKeyframes driven =
        testing::DriveThrough({.first = 40, .count = 3}, MapProfile());
    std::vector<SubmapMember> members;
    for (std::uint32_t i = 0; i < 3; ++i) {
      members.push_back(
          {{{"car", "drive"}, i}, 250 * i, driven.T_world_sensor[i], driven.keyframes[i]});
    }
    submap_ = std::make_unique<Submap>(Submap::Fuse(members, 7, MapProfile(), {}).value());
  }
  static void TearDownTestSuite() { submap_.reset(); }

  void Open(std::uint64_t rules = 1, std::uint64_t max_bytes = kMuch) {
    work_.reset();
    auto work = MergeWork::Open(folder_.path() / "work", rules, max_bytes);
    ASSERT_TRUE(work.has_value()) << work.error().message();
    work_ = std::make_unique<MergeWork>(*std::move(work));
  }
  SubmapName Keep(std::uint64_t content) {
    return work_->KeepSubmap(content, shape_, *submap_).value().name;
  }
  std::vector<fs::path> Files() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_.path() / "work")) {
      if (entry.path().extension() == ".submap") files.push_back(entry.path());
    }
    return files;
  }

  inline static std::unique_ptr<Submap> submap_;
  TestFolder folder_;
  std::unique_ptr<MergeWork> work_;
  std::vector<Pose> shape_{At(-1.0), At(0.0), At(1.0)};
};

TEST_F(MergeWorkTest, ASubmapComesBackAsItWas) {
  Open();
  const SubmapName name = Keep(5);
  for (int run = 0; run < 2; ++run) {
    const auto sketch = work_->FindSubmap(5, shape_, kTolerance);
    ASSERT_TRUE(sketch.has_value());
    EXPECT_EQ(sketch->name, name);
    ASSERT_EQ(sketch->places.size(), submap_->places().size());
    ASSERT_GT(sketch->places.size(), 0U);
    EXPECT_EQ(sketch->places[0].ground, submap_->places()[0].ground);
    EXPECT_EQ(sketch->places[0].profile.ranges, submap_->places()[0].profile.ranges);
    const auto loaded = work_->LoadSubmap(name);
    ASSERT_TRUE(loaded.has_value());
    EXPECT_EQ(loaded->Encode(), submap_->Encode());
    EXPECT_EQ(loaded->radius_m(), submap_->radius_m());
    EXPECT_EQ(loaded->features().columns, submap_->features().columns);
    EXPECT_EQ(loaded->features().ground, submap_->features().ground);
    EXPECT_EQ(loaded->features().returns, submap_->features().returns);
    EXPECT_EQ(loaded->DecodeTiles(MapProfile()).value().size(),
              submap_->DecodeTiles(MapProfile()).value().size());
    Open();
  }
}

TEST_F(MergeWorkTest, OnlyItsContentAndItsShapeFindIt) {
  Open();
  Keep(5);
  EXPECT_FALSE(work_->FindSubmap(6, shape_, kTolerance).has_value());
  EXPECT_FALSE(work_->FindSubmap(5, std::vector<Pose>{At(-1.0), At(0.0)}, kTolerance).has_value());
  shape_[2] = At(1.0049, 0.059 * kDegree);
  EXPECT_TRUE(work_->FindSubmap(5, shape_, kTolerance).has_value());
  shape_[2] = At(1.0051);
  EXPECT_FALSE(work_->FindSubmap(5, shape_, kTolerance).has_value());
  shape_[2] = At(1.0, 0.061 * kDegree);
  EXPECT_FALSE(work_->FindSubmap(5, shape_, kTolerance).has_value());
  const SubmapName other = Keep(5);
  EXPECT_EQ(work_->FindSubmap(5, shape_, kTolerance)->name, other);
}

TEST_F(MergeWorkTest, MatchesAreOfTheirSubmapsAndStarts) {
  Open();
  const SubmapName a = Keep(5);
  const SubmapName b = Keep(6);
  const MatchRecord record = MatchOf(a, b);
  ASSERT_TRUE(work_->KeepMatch(record).ok());
  for (int run = 0; run < 2; ++run) {
    const auto found = work_->FindMatch(a, b, At(1.2, 1.4 * kDegree));
    ASSERT_TRUE(found.has_value());
    ExpectSame(*found, record.match);
    EXPECT_FALSE(work_->FindMatch(b, a, At(1.0)).has_value());
    EXPECT_FALSE(work_->FindMatch(a, a, At(1.0)).has_value());
    EXPECT_FALSE(work_->FindMatch({5, a.shape + 1}, b, At(1.0)).has_value());
    EXPECT_FALSE(work_->FindMatch(a, b, At(1.26)).has_value());
    EXPECT_FALSE(work_->FindMatch(a, b, At(1.0, 1.6 * kDegree)).has_value());
    Open();
  }
}

TEST_F(MergeWorkTest, SearchesAreOfAnyShapeAndTellWhereNothingIs) {
  Open();
  Keep(5);
  Keep(6);
  const SearchReach reach{2.0, 3.0, 0.1, 0.4};
  ASSERT_TRUE(work_->KeepSearch({5, 6, At(1.0), reach, At(2.5)}).ok());
  ASSERT_TRUE(work_->KeepSearch({6, 5, At(1.0), reach, std::nullopt}).ok());
  for (int run = 0; run < 2; ++run) {
    const auto found = work_->FindSearch(5, 6, At(1.4, 1.9 * kDegree), reach);
    ASSERT_TRUE(found.has_value() && found->T_a_b.has_value());
    EXPECT_EQ(found->T_a_b->matrix(), At(2.5).matrix());
    const auto nothing = work_->FindSearch(6, 5, At(1.0), reach);
    ASSERT_TRUE(nothing.has_value());
    EXPECT_FALSE(nothing->T_a_b.has_value());
    EXPECT_FALSE(work_->FindSearch(5, 6, At(1.6), reach).has_value());
    EXPECT_FALSE(work_->FindSearch(5, 6, At(1.0), {2.0, 3.0, 0.2, 0.4}).has_value());
    EXPECT_FALSE(work_->FindSearch(5, 7, At(1.0), reach).has_value());
    Open();
  }
}

TEST_F(MergeWorkTest, WhatIsWithoutItsFileIsForgottenWithAllThatWasFoundWithIt) {
  Open();
  const SubmapName a = Keep(5);
  const SubmapName b = Keep(6);
  ASSERT_TRUE(work_->KeepMatch(MatchOf(a, b)).ok());
  ASSERT_TRUE(work_->KeepSearch({5, 6, At(1.0), {}, At(2.5)}).ok());
  work_.reset();
  for (const fs::path& file : Files()) {
    if (file.filename().string().front() == '6') fs::remove(file);
  }
  for (int run = 0; run < 2; ++run) {
    Open();
    EXPECT_TRUE(work_->FindSubmap(5, shape_, kTolerance).has_value());
    EXPECT_FALSE(work_->FindSubmap(6, shape_, kTolerance).has_value());
    EXPECT_FALSE(work_->FindMatch(a, b, At(1.0)).has_value());
    EXPECT_FALSE(work_->FindSearch(5, 6, At(1.0), {}).has_value());
  }
}

// As a loss of power may leave it: another merge makes it anew and goes on.
TEST_F(MergeWorkTest, WhatWasDamagedBetweenMergesIsNotFound) {
  Open();
  const SubmapName name = Keep(5);
  const Bytes whole = LoadFile(Files()[0], kMuch).value();
  Bytes flipped = whole;
  flipped[flipped.size() / 2] ^= 4;
  const Bytes cut(whole.begin(), whole.begin() + 500);
  for (const Bytes& bytes : {flipped, cut, Bytes()}) {
    Open();
    ASSERT_TRUE(StoreFile(Files()[0], bytes, Durability::kWhole).ok());
    EXPECT_FALSE(work_->FindSubmap(5, shape_, kTolerance).has_value());
    EXPECT_TRUE(Files().empty());
    EXPECT_EQ(Keep(5), name);
    EXPECT_TRUE(work_->FindSubmap(5, shape_, kTolerance).has_value());
    EXPECT_TRUE(work_->LoadSubmap(name).has_value());
  }
}

TEST_F(MergeWorkTest, ADamagedFileIsToldAndMadeAnew) {
  Open();
  const SubmapName name = Keep(5);
  Bytes bytes = LoadFile(Files()[0], kMuch).value();
  bytes[bytes.size() / 2] ^= 4;
  ASSERT_TRUE(StoreFile(Files()[0], bytes, Durability::kWhole).ok());
  const auto damaged = work_->LoadSubmap(name);
  ASSERT_FALSE(damaged.has_value());
  EXPECT_EQ(damaged.error().code(), StatusCode::kInvalidData);
  EXPECT_FALSE(work_->FindSubmap(5, shape_, kTolerance).has_value());
  EXPECT_EQ(Keep(5), name);
  EXPECT_TRUE(work_->LoadSubmap(name).has_value());
}

TEST_F(MergeWorkTest, WhatWasMadeByOtherRulesIsGone) {
  Open(1);
  Keep(5);
  Open(2);
  EXPECT_FALSE(work_->FindSubmap(5, shape_, kTolerance).has_value());
  EXPECT_TRUE(Files().empty());
}

// The one that was asked for last stays.
TEST_F(MergeWorkTest, ItTakesNoMoreThanItMay) {
  Open();
  for (const std::uint64_t content : {5U, 6U, 7U}) Keep(content);
  const std::vector<fs::path> files = Files();
  ASSERT_EQ(files.size(), 3U);
  for (const fs::path& file : files) {
    fs::last_write_time(file, fs::last_write_time(file) - std::chrono::hours(1));
  }
  EXPECT_TRUE(work_->FindSubmap(6, shape_, kTolerance).has_value());
  Open(1, fs::file_size(files[0]) + 1);
  EXPECT_EQ(Files().size(), 1U);
  EXPECT_TRUE(work_->FindSubmap(6, shape_, kTolerance).has_value());
}

TEST_F(MergeWorkTest, WhatOthersHaveThereStays) {
  fs::create_directories(folder_.path() / "work");
  const fs::path partial = folder_.path() / "work/film.partial";
  const fs::path text = folder_.path() / "work/letter.txt";
  const fs::path left = folder_.path() / "work/1-2.submap.partial";
  for (const fs::path& file : {partial, text, left}) {
    ASSERT_TRUE(StoreFile(file, Bytes(3), Durability::kWhole).ok());
  }
  Open();
  EXPECT_TRUE(fs::exists(partial));
  EXPECT_TRUE(fs::exists(text));
  EXPECT_FALSE(fs::exists(left)) << "of a write that never ended";
}

TEST_F(MergeWorkTest, OneProgramAtATimeWorksInIt) {
  Open();
  const auto second = MergeWork::Open(folder_.path() / "work", 1, kMuch);
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code(), StatusCode::kConflict);
}

TEST_F(MergeWorkTest, ATemporaryOneGoes) {
  const auto entries = [] {
    std::set<fs::path> found;
    for (const auto& entry : fs::directory_iterator(fs::temp_directory_path())) {
      found.insert(entry.path());
    }
    return found;
  };
  const std::set<fs::path> before = entries();
  std::set<fs::path> during;
  {
    MergeWork work = MergeWork::Temporary().value();
    ASSERT_TRUE(work.KeepSubmap(5, shape_, *submap_).has_value());
    EXPECT_TRUE(work.FindSubmap(5, shape_, kTolerance).has_value());
    during = entries();
  }
  const std::set<fs::path> after = entries();
  std::size_t came_and_went = 0;
  for (const fs::path& path : during) {
    came_and_went += !before.contains(path) && !after.contains(path) ? 1U : 0U;
  }
  EXPECT_GE(came_and_went, 1U);
}

TEST_F(MergeWorkTest, NoTurnedBitOfASubmapIsOne) {
  const Bytes whole = submap_->Encode();
  for (std::size_t byte = 0; byte < whole.size(); byte += 97) {
    Bytes turned = whole;
    turned[byte] ^= static_cast<std::uint8_t>(1U << (byte % 8));
    EXPECT_FALSE(Submap::Decode(turned).has_value()) << byte;
  }
  for (std::size_t size = 0; size < whole.size(); size += 997) {
    EXPECT_FALSE(Submap::Decode(ByteSpan(whole).first(size)).has_value()) << size;
  }
}

}  // namespace
}  // namespace atlas
