// What becomes of tiles when the daemon, or who verifies them, stops while they are built.
#include "server/service/fusion/tile_refresher.h"

#include <algorithm>
#include <stop_token>

#include "server/service/verification/atlas_verify.h"
#include "tests/server/service/blob_reads.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

class TileRefresherTest : public ServiceTest {
 protected:
  // Stops while the second keyframe of a tile of several is read.
  struct Stopped {
    int reads = 0;
    StatusCode code = StatusCode::kOk;
  };
  Stopped StopWithin(const TileRefresherOptions& options) {
    std::stop_source stop;
    Stopped stopped;
    const BlobReads reads([&] {
      if (++stopped.reads == 2) {
        stop.request_stop();
      }
    });
    Open(0);
    UploadDrive(6);
    const std::vector<TileId> tiles = store_->ListFootprintTiles(0, -1, 100).value();
    const auto keyframes = [&](const TileId& tile) {
      return store_->ListKeyframesOfTile(tile).value().size();
    };
    const TileId most = *std::max_element(
        tiles.begin(), tiles.end(),
        [&](const TileId& a, const TileId& b) { return keyframes(a) < keyframes(b); });
    EXPECT_GT(keyframes(most), 3u);
    EXPECT_EQ(stopped.reads, 0);
    TileRefresher refresher(*store_, options, [](LogLevel, const std::string&) {});
    refresher.Build(std::span(&most, 1), stop.get_token(),
                    [&](const TileId&, const Result<BuiltTile>& built) {
                      stopped.code = built ? StatusCode::kOk : built.error().code();
                    });
    return stopped;
  }
};

TEST_F(TileRefresherTest, WhatIsNotBegunWhenItStopsIsLeft) {
  Open(0);
  UploadDrive(4);
  const std::vector<TileId> tiles = store_->ListFootprintTiles(0, -1, 100).value();
  ASSERT_GT(tiles.size(), 1u);
  TileRefresher refresher(*store_, {}, [](LogLevel, const std::string&) {});
  std::stop_source stop;
  std::size_t built = 0;
  std::size_t left = 0;
  const auto count = [&](const TileId&, const Result<BuiltTile>& tile) {
    built += tile ? 1u : 0u;
    left += !tile && tile.error().code() == StatusCode::kUnavailable ? 1u : 0u;
  };
  refresher.Build(tiles, stop.get_token(), count);
  EXPECT_EQ(built, tiles.size());
  stop.request_stop();
  refresher.Build(tiles, stop.get_token(), count);
  EXPECT_EQ(built, tiles.size());
  EXPECT_EQ(left, tiles.size());
}

TEST_F(TileRefresherTest, WhatIsBegunWhenItStopsIsDone) {
  const Stopped stopped = StopWithin({});
  EXPECT_EQ(stopped.code, StatusCode::kOk);
  EXPECT_GT(stopped.reads, 3);
}

TEST_F(TileRefresherTest, WhatTakesTooLongWhenItStopsIsLeft) {
  TileRefresherOptions options;
  options.stop_grace = std::chrono::milliseconds(0);
  const Stopped stopped = StopWithin(options);
  EXPECT_EQ(stopped.code, StatusCode::kUnavailable);
  EXPECT_EQ(stopped.reads, 2);
}

TEST_F(TileRefresherTest, SoIsATileThatIsTooLargeForItsSurveys) {
  TileRefresherOptions options;
  options.stop_grace = std::chrono::milliseconds(0);
  options.surveys = {1, 1};
  options.group_bytes = 1;
  const Stopped stopped = StopWithin(options);
  EXPECT_EQ(stopped.code, StatusCode::kUnavailable);
  EXPECT_EQ(stopped.reads, 2);
}

// So a deadline ends a verification within a tile of very many keyframes, too.
TEST_F(TileRefresherTest, WhoVerifiesIsAskedBeforeEachKeyframe) {
  bool is_asked = false;
  int reads = 0;
  int unasked = 0;
  const BlobReads watch([&] {
    ++reads;
    unasked += is_asked ? 0 : 1;
    is_asked = false;
  });
  Open(1);
  UploadDrive(6);
  Digest();
  reads = unasked = 0;
  AtlasVerifier::Options options;
  options.request.rebuild = true;
  options.check_stop = [&] {
    is_asked = true;
    return Status();
  };
  const auto report = AtlasVerifier(*store_, options).Run();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->damaged + report->mismatched, 0u);
  EXPECT_GT(reads, 6);
  EXPECT_EQ(unasked, 0);
}

}  // namespace
}  // namespace atlas
