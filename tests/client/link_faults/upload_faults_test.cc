// Uploads over links that fail: each keyframe is there once, and the map is the one of a link that
// does not. ATLAS_TEST_SCALE=20 makes 11,520 keyframes of it.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <future>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/base/hash.h"
#include "tests/client/end_to_end/daemon_process.h"
#include "tests/client/ledger/clean_atlas.h"
#include "tests/client/link_faults/fault_plans.h"
#include "tests/client/link_faults/upload_load.h"
#include "tests/core/support/test_scale.h"

namespace atlas::testing {
namespace {

constexpr std::uint32_t kSeed = 20'262;
constexpr std::uint32_t kFramesOfAVehicle = 96;
constexpr int kVehicles = 6;

std::vector<std::string> Flags() {
  return {"--cell-size", "0.2", "--log-level", "error"};
}

std::vector<FrameId> Frames() {
  std::vector<FrameId> frames;
  for (std::uint32_t i = 0; i < Scaled(kFramesOfAVehicle); ++i) {
    frames.push_back({i / kFramesOfASession, i % kFramesOfASession});
  }
  return frames;
}

std::vector<FrameId> Shuffled(std::vector<FrameId> frames, std::uint32_t seed) {
  std::mt19937 random(seed);
  for (std::size_t i = frames.size(); i > 1; --i) {
    std::swap(frames[i - 1], frames[random() % i]);
  }
  return frames;
}

class UploadFaultsTest : public ::testing::Test {
 protected:
  UploadFaultsTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("atlas_upload_faults." + std::to_string(getpid()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~UploadFaultsTest() override { std::filesystem::remove_all(folder_); }

  // Two that send directly, one that resumes, one with a spool, and two that send the same over two
  // or three connections at a time, in as many orders.
  void UploadAll(const Endpoint& endpoint) {
    const auto load = [&](int vehicle, std::uint32_t order) {
      return UploadLoad{endpoint, vehicle, order == 0 ? Frames() : Shuffled(Frames(), order),
                        std::chrono::seconds(60 + Scaled(20))};
    };
    std::vector<std::future<Result<UploadCount>>> uploads;
    const auto begin = [&uploads](auto upload) {
      uploads.push_back(std::async(std::launch::async, std::move(upload)));
    };
    for (const auto& [vehicle, order] : std::vector<std::pair<int, std::uint32_t>>{
             {0, 0}, {1, 1}, {4, 0}, {4, 2}, {5, 3}, {5, 4}, {5, 5}}) {
      begin([one = load(vehicle, order)] { return UploadDirectly(one); });
    }
    begin([one = load(2, 0)] { return UploadResuming(one); });
    begin([one = load(3, 0), spool = folder_ / "spool"] { return UploadThroughSpool(one, spool); });
    for (auto& upload : uploads) {
      const auto count = upload.get();
      ASSERT_TRUE(count) << count.error().message();
      sent_ += count->sent;
      duplicates_ += count->duplicates;
    }
  }

  static void ExpectIsWhatWasSent(const StoredAtlas& atlas) {
    EXPECT_EQ(atlas.twice, 0U);
    EXPECT_EQ(atlas.frames.size(), kVehicles * Frames().size());
    for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
      for (const FrameId& frame : Frames()) {
        const KeyframeKey key = FleetKey(vehicle, frame);
        ASSERT_TRUE(atlas.frames.contains(key)) << key;
        const StoredFrame& stored = atlas.frames.at(key);
        EXPECT_EQ(stored.time_ms, FleetTime(frame)) << key;
        EXPECT_EQ(stored.pose, FleetPose(vehicle, frame, 0)) << key;
        EXPECT_EQ(stored.blob_hash, Hash64(FleetBlob(key))) << key;
      }
    }
  }

  static Bytes DigestOf(const DaemonProcess& daemon) {
    ConnectionOptions options;
    options.endpoint = {"127.0.0.1", daemon.port()};
    auto client = AtlasClient::Connect(options);
    EXPECT_TRUE(client);
    const auto digest = client->Digest(std::chrono::seconds(120));
    EXPECT_TRUE(digest) << digest.error().message();
    return digest ? digest->sha256 : Bytes();
  }

  std::filesystem::path folder_;
  std::uint64_t sent_ = 0;  // but for the spool's, as is the next
  std::uint64_t duplicates_ = 0;
};

TEST_F(UploadFaultsTest, EachKeyframeIsThereOnceWhateverTheLinkDoes) {
  std::cout << "link faults: seed " << kSeed << std::endl;
  DaemonProcess daemon(folder_ / "data", Flags());
  LinkTotals totals;
  {
    LinkProxy proxy({"127.0.0.1", daemon.port()}, FaultPlans(kSeed));
    ASSERT_NO_FATAL_FAILURE(UploadAll(proxy.endpoint()));
    totals = proxy.totals();
  }
  const Bytes digest = DigestOf(daemon);
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  const StoredAtlas atlas = ReadStoredAtlas(folder_ / "data");
  ExpectIsWhatWasSent(atlas);
  EXPECT_EQ(digest, CleanDigest(atlas, folder_ / "clean", Flags()));
  std::cout << "link faults: " << atlas.frames.size() << " keyframes of " << kVehicles
            << " vehicles, sent " << sent_ << " times, " << duplicates_ << " duplicates; "
            << totals.connections << " connections, " << totals.cuts << " cut, " << totals.stalls
            << " stalled, refused for a while " << totals.refusals << " times; "
            << totals.bytes_up / 1'000 << " kB up" << std::endl;
  EXPECT_GT(totals.cuts, 0U);  // else nothing was tested
  EXPECT_GT(duplicates_, 0U);
}

}  // namespace
}  // namespace atlas::testing
