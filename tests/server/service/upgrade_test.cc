// Atlases of every earlier schema, served: their tiles are fused again by today's rules, and
// vehicles go on in them.
#include "tests/server/service/service_fixture.h"
#include "tests/server/store/earlier_stores.h"

namespace atlas {
namespace {

class UpgradeTest : public ServiceTest,
                    public ::testing::WithParamInterface<testing::EarlierStore> {
 protected:
  void SetUp() override {
    testing::MakeEarlierStore(GetParam(), directory_ / "data" / "atlas.db");
    Open();
  }
  // As it was uploaded, but for its pose: that is today's.
  UploadRequest UploadOf(std::int64_t id) {
    const StoredKeyframe keyframe = store_->ReadKeyframe(id).value();
    UploadRequest request;
    request.key = keyframe.record.key;
    request.time_ms = keyframe.record.time_ms;
    request.pose = keyframe.record.pose;
    request.blob = store_->ReadKeyframeBlob(id).value();
    return request;
  }
  std::vector<std::int64_t> Ids() { return store_->ListKeyframeIds(0, 1'000).value(); }
  void ExpectSound() {
    const auto report = service_->Verify({.rebuild = true}, Long());
    ASSERT_TRUE(report.has_value()) << report.error().message();
    EXPECT_EQ(report->damaged + report->mismatched, 0u) << report->findings.front();
    EXPECT_GT(report->checked, 10u);
  }
};

INSTANTIATE_TEST_SUITE_P(Versions,
                         UpgradeTest,
                         ::testing::ValuesIn(testing::kEarlierStores),
                         [](const auto& made) { return std::string(made.param.name); });

TEST_P(UpgradeTest, ItBecomesWhatAFreshAtlasOfItsKeyframesIs) {
  const AtlasDigest upgraded = Digest();
  EXPECT_GT(upgraded.tiles, 10u);
  ExpectSound();
  std::vector<UploadRequest> uploads;
  for (const std::int64_t id : Ids()) {
    if (IsInMap(store_->ReadKeyframe(id)->record.session_state)) {
      uploads.push_back(UploadOf(id));
    }
  }
  profile_ = store_->identity().profile;
  Open(2, "fresh");
  for (UploadRequest& upload : uploads) {
    const auto put = Upload(std::move(upload));
    ASSERT_TRUE(put.has_value()) << put.error().message();
  }
  const AtlasDigest fresh = Digest();
  EXPECT_EQ(upgraded.sha256, fresh.sha256);
  EXPECT_EQ(upgraded.tiles, fresh.tiles);
}

TEST_P(UpgradeTest, WhatIsSentAgainIsADuplicateAndNewKeyframesAreFused) {
  const AtlasDigest before = Digest();
  for (const std::int64_t id : Ids()) {
    const auto put = Upload(UploadOf(id));
    ASSERT_TRUE(put.has_value()) << put.error().message();
    EXPECT_TRUE(put->is_duplicate);
  }
  UploadRequest request = UploadOf(Ids().front());
  request.key.sequence = 77;
  request.pose.x_um += 5'000'000;
  request.blob = EncodeKeyframe(testing::StreetKeyframe(store_->identity().profile, 8, 300));
  const auto put = Upload(request);
  ASSERT_TRUE(put.has_value()) << put.error().message();
  EXPECT_FALSE(put->is_duplicate);
  EXPECT_NE(Digest().sha256, before.sha256);
  ExpectSound();
}

// A compaction dropped what was sent before: it is known all the same.
TEST_P(UpgradeTest, WhatWasDroppedIsKnown) {
  std::uint64_t dropped = 0;
  const auto sessions = store_->ListSessions({}, 1'000).value();
  for (const SessionRecord& session : sessions) {
    dropped += session.compacted;
  }
  EXPECT_EQ(dropped, service_->ReadStatus()->counts.compacted);
  if (dropped == 0) {
    GTEST_SKIP() << "nothing was";
  }
  UploadRequest request;
  request.key = {{"bus", "night"}, 0};
  request.time_ms = 2'000'000;
  request.pose = PoseOf(PoseAlong(0));
  request.blob = EncodeKeyframe(testing::StreetKeyframe(store_->identity().profile, 8, 100));
  const auto again = Upload(request);
  ASSERT_TRUE(again.has_value()) << again.error().message();
  EXPECT_TRUE(again->is_duplicate);
  request.time_ms += 1;
  EXPECT_EQ(Upload(request).error().code(), StatusCode::kConflict);
}

}  // namespace
}  // namespace atlas
