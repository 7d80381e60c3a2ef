// An upload for which there is no room, as its vehicle hears of it.
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

class RetentionRequestsTest : public NetTest {
 protected:
  std::optional<wire::Envelope> Send(BlockingPeer& peer, std::uint32_t i) {
    peer.Send(UploadOf(i, 9));
    return peer.Receive();
  }
  wire::StatusReply StatusNow(BlockingPeer& peer) {
    peer.Send(StatusOf(3));
    return peer.Receive()->status_reply();
  }
};

TEST_F(RetentionRequestsTest, AQuotaIsSaidWithItsReasonAndAWait) {
  Serve(1);
  const auto peer = Connect();
  EXPECT_TRUE(Send(*peer, 0)->has_upload_reply());
  service_->SetRetention({{.vehicle_bytes = DriveUpload(0).blob.size() + 10}, false});
  const auto refused = Send(*peer, 1);
  ASSERT_EQ(CodeOf(refused), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused->error().reason(), "quota");
  EXPECT_TRUE(refused->error().retry());
  EXPECT_EQ(refused->error().retry_after_ms(), 60'000u);
  EXPECT_NE(refused->error().message().find("vehicle bus"), std::string::npos);
  const auto behind = Send(*peer, 2);
  EXPECT_EQ(CodeOf(behind), StatusCode::kUnavailable) << "no gaps";
  EXPECT_EQ(behind->error().reason(), "");
  EXPECT_EQ(StatusNow(*peer).refusing(), "") << "others may upload";
  service_->SetRetention({});
  EXPECT_TRUE(Send(*peer, 1)->has_upload_reply());
  EXPECT_TRUE(Send(*peer, 2)->has_upload_reply());
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 3u);
}

TEST_F(RetentionRequestsTest, AFullStoreIsShownByTheStatusAndReadsGoOn) {
  Serve(1);
  const auto peer = Connect();
  UploadDrive(2);
  Digest();
  EXPECT_EQ(StatusNow(*peer).store_limit_bytes(), 0u);
  service_->SetRetention({{.store_bytes = 1'000, .disk_floor_bytes = 1}, false});
  const auto refused = Send(*peer, 2);
  ASSERT_EQ(CodeOf(refused), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused->error().reason(), "store_limit");
  const wire::StatusReply status = StatusNow(*peer);
  EXPECT_EQ(status.refusing(), "store_limit");
  EXPECT_EQ(status.store_limit_bytes(), 1'000u);
  EXPECT_EQ(status.used_bytes(), store_->ReadRoom().used_bytes);
  EXPECT_EQ(status.disk_floor_bytes(), 1u);
  EXPECT_GT(status.disk_free_bytes(), 0u);
  peer->Send(QueryOf(5));
  auto reply = peer->Receive();
  EXPECT_TRUE(reply->has_tile());
}

}  // namespace
}  // namespace atlas
