// Sessions taken out of the map and put back: what is left is what would be there without them.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

using RetractionTest = ServiceTest;

TEST_F(RetractionTest, RetractingLeavesWhatWouldBeThereWithoutTheSession) {
  Open();
  UploadDrive(6);
  const AtlasDigest day = Digest();
  for (std::uint32_t i = 0; i < 6; ++i) {
    ASSERT_TRUE(Upload(DriveUpload(i + 2, "night")).has_value());
  }
  const AtlasDigest both = Digest();
  ASSERT_NE(both.sha256, day.sha256);
  const auto retracted = Change("night", SessionAction::kRetract);
  ASSERT_TRUE(retracted.has_value()) << retracted.error().message();
  EXPECT_GT(retracted->tiles_marked, 0u);
  EXPECT_EQ(Digest().sha256, day.sha256);
  ASSERT_TRUE(Change("night", SessionAction::kRestore).has_value());
  EXPECT_EQ(Digest().sha256, both.sha256);
  ASSERT_TRUE(Change("day", SessionAction::kRetract).has_value());
  ASSERT_TRUE(Change("night", SessionAction::kRetract).has_value());
  EXPECT_EQ(Digest().tiles, 0u);
  EXPECT_EQ(service_->Verify({.rebuild = true}, Long())->mismatched, 0u);
  EXPECT_EQ(DigestAt(both.revision).sha256, both.sha256);
}

TEST_F(RetractionTest, WhatIsDoneToARetractedSessionShowsWhenItIsRestored) {
  Open();
  UploadDrive(3);
  ASSERT_TRUE(Change("day", SessionAction::kRetract).has_value());
  ASSERT_EQ(Digest().tiles, 0u);
  EXPECT_EQ(Upload(DriveUpload(3))->tiles_marked, 0u);
  EXPECT_TRUE(Upload(DriveUpload(3))->is_duplicate);
  EXPECT_EQ(Move({{DriveUpload(0).key, PoseOf({5.0, 3.0, 1.8, 40.0})}})->tiles_marked, 0u);
  EXPECT_EQ(Digest().tiles, 0u);
  ASSERT_TRUE(Change("day", SessionAction::kRestore).has_value());
  const AtlasDigest restored = Digest();
  Open(1, "reference");
  UploadDrive(4);
  ASSERT_TRUE(Move({{DriveUpload(0).key, PoseOf({5.0, 3.0, 1.8, 40.0})}}).has_value());
  EXPECT_EQ(restored.sha256, Digest().sha256);
}

// All sessions of a vehicle in one step: the atlas never saw it.
TEST_F(RetractionTest, AVehicleIsRetractedAndRestored) {
  const auto fill = [this](const std::vector<std::string>& vehicles) {
    Open();
    for (std::uint32_t i = 0; i < 6; ++i) {
      for (const std::string& vehicle : vehicles) {
        UploadRequest upload = DriveUpload(i, i % 2 == 0 ? "day" : "night");
        upload.key.session.vehicle = vehicle;
        ASSERT_TRUE(Upload(std::move(upload)));
      }
    }
  };
  const auto change = [this](SessionAction action, const std::string& vehicle) {
    return Await<SessionChangeResult>([&](auto done) {
      service_->ChangeSession({{vehicle, ""}, action, "tester", ""}, std::move(done));
    });
  };
  fill({"bus"});
  const AtlasDigest without = Digest();
  Close();
  std::filesystem::remove_all(directory_ / "data");
  fill({"bus", "truck"});
  const AtlasDigest with = Digest();
  EXPECT_NE(with.sha256, without.sha256);
  const auto retracted = change(SessionAction::kRetract, "truck");
  ASSERT_TRUE(retracted) << retracted.error().message();
  EXPECT_EQ(retracted->sessions, 2u);
  EXPECT_TRUE(retracted->is_changed);
  EXPECT_EQ(Digest().sha256, without.sha256);
  EXPECT_FALSE(change(SessionAction::kRetract, "truck")->is_changed);
  EXPECT_EQ(change(SessionAction::kRestore, "truck")->sessions, 2u);
  EXPECT_EQ(Digest().sha256, with.sha256);
  EXPECT_EQ(change(SessionAction::kRetract, "tram").error().code(), StatusCode::kNotFound);
}

TEST_F(RetractionTest, SessionChangesAreChecked) {
  Open();
  UploadDrive(1);
  const auto code = [&](SessionChange change) {
    const auto result = Await<SessionChangeResult>(
        [&](auto done) { service_->ChangeSession(std::move(change), std::move(done)); });
    return result ? StatusCode::kOk : result.error().code();
  };
  EXPECT_EQ(code({{"bus", "dusk"}, SessionAction::kRetract, "", ""}), StatusCode::kNotFound);
  EXPECT_EQ(code({{"bus", "a/b"}, SessionAction::kRetract, "", ""}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{"", "day"}, SessionAction::kRetract, "", ""}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{"bus", "day"}, SessionAction::kRetract, "a b", ""}),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{"bus", "day"}, SessionAction::kRetract, "me", "two\nlines"}),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{"bus", "day"}, SessionAction::kRetract, "me", std::string(257, 'x')}),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{"bus", "day"}, SessionAction::kRetract, "me", "parked cars"}), StatusCode::kOk);
}

}  // namespace
}  // namespace atlas
