// The map over links that fail: a vehicle holds what the daemon has in the end, for few bytes more
// than over a link that does not fail, and whoever watches is told everything.
#include <chrono>
#include <iostream>
#include <map>
#include <optional>
#include <random>

#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/client/link_faults/fault_plans.h"
#include "tests/client/link_faults/tile_watcher.h"
#include "tests/client/link_faults/upload_load.h"
#include "tests/core/support/test_scale.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::seconds;

constexpr std::uint32_t kSeed = 20'263;
constexpr std::uint32_t kRounds = 12;
constexpr seconds kPatience{60};
// What a cut costs is what had come of a frame, and a handshake: 2 % to 12 % more, measured.
// Who began again each time would pay several times as much.
constexpr double kMostBytes = 1.3;

class MapFaultsTest : public VehicleTest {
 protected:
  void SetUp() override {
    std::cout << "link faults: seed " << kSeed << std::endl;
    daemon_.emplace(NewData(), kSmall);
    Fill(*daemon_);
    client_.emplace(Connect(*daemon_));
  }

  Endpoint daemon() const { return *Endpoint::Parse(daemon_->address()); }

  // Over a clean link: poses are corrected, sessions retracted and restored.
  void ChangeAtlas() {
    if (random_() % 4 == 0) {
      const auto action = is_retracted_ ? SessionAction::kRestore : SessionAction::kRetract;
      ASSERT_TRUE(client_->ChangeSession({"vehicle", "overpass.2"}, action, "test"));
      is_retracted_ = !is_retracted_;
    } else {
      const auto scan = static_cast<std::uint32_t>(random_() % 6);
      const PoseCorrection moved{
          {{"vehicle", "overpass"}, scan},
          PoseOf(static_cast<int>(scan), 0.01 * static_cast<double>(random_() % 200))};
      ASSERT_TRUE(client_->UpdatePoses(std::span(&moved, 1), "test"));
    }
    ASSERT_TRUE(client_->WaitUntilFused(kPatience));
  }

  // In as many connections as it takes.
  static void SyncWhole(AtlasLink& link, TileStore& store) {
    const Clock::time_point end = Clock::now() + kPatience;
    for (bool is_complete = false; !is_complete;) {
      ASSERT_LT(Clock::now(), end) << "the store does not become complete";
      const auto client = link.Wait(seconds(1));
      if (!client) continue;
      const auto report = SyncStore(**client, store, Everywhere());
      link.Report(report ? Status() : report.error());
      is_complete = report && report->is_complete;
    }
  }

  // What the same takes over a clean link: all bytes that come, for as many connections.
  std::uint64_t CleanBytes(const fs::path& folder) const {
    const fs::path copy = folder.string() + ".copy";
    fs::remove_all(copy);
    fs::copy(folder, copy, fs::copy_options::recursive);
    AtlasClient client = Connect(daemon());
    TileStore store = StoreFor(client, copy);
    const auto report = SyncStore(client, store, Everywhere());
    EXPECT_TRUE(report && report->is_complete);
    return client.bytes_received();
  }

  std::mt19937 random_{kSeed};
  std::optional<DaemonProcess> daemon_;
  std::optional<AtlasClient> client_;
  bool is_retracted_ = false;
};

TEST_F(MapFaultsTest, AStoreConvergesForFewBytesMore) {
  const fs::path folder = shared_root / "faulty";
  FaultOptions faults;
  faults.max_bytes_up = 3'000;
  faults.max_bytes_down = 60'000;
  LinkProxy proxy(daemon(), FaultPlans(kSeed, faults));
  AtlasLink link(HastyLink(proxy.endpoint()));
  std::uint64_t clean_bytes = 0;
  for (std::uint32_t round = 0; round < Scaled(kRounds); ++round) {
    SCOPED_TRACE(round);
    fs::create_directories(folder);
    clean_bytes += CleanBytes(folder);
    TileStore store = StoreFor(*client_, folder);
    ASSERT_NO_FATAL_FAILURE(SyncWhole(link, store));
    ASSERT_EQ(Held(store), AtlasNow(*client_));
    ASSERT_NO_FATAL_FAILURE(ChangeAtlas());
  }
  const LinkTotals totals = proxy.totals();
  std::cout << "link faults: " << Scaled(kRounds) << " syncs over " << totals.connections
            << " connections, " << totals.cuts << " cut, " << totals.stalls << " stalled; "
            << totals.bytes_down / 1'000 << " kB came, " << clean_bytes / 1'000
            << " kB over a clean link" << std::endl;
  EXPECT_GT(totals.cuts, 0U);
  EXPECT_LT(static_cast<double>(totals.bytes_down), kMostBytes * static_cast<double>(clean_bytes));
}

TEST_F(MapFaultsTest, AWatchThatComesBackMissesNothing) {
  FaultOptions faults;
  faults.max_bytes_up = 20;  // in the handshake
  faults.max_bytes_down = 4'000;
  std::optional<LinkProxy> proxy(std::in_place, daemon(), FaultPlans(kSeed, faults));
  TileWatcher watcher(daemon(), proxy->endpoint());
  for (std::uint32_t round = 0; round < Scaled(3 * kRounds) || watcher.watches() < 3; ++round) {
    ASSERT_LT(round, 1'000U) << "the watch does not come back";
    ASSERT_NO_FATAL_FAILURE(ChangeAtlas());
    std::map<TileId, std::uint64_t> revisions;
    ASSERT_TRUE(client_->QueryRegion({}, [&](const TileBlob& tile) {
      revisions[tile.id] = tile.revision;
      return Status();
    }));
    ASSERT_TRUE(watcher.Await(revisions, kPatience)) << "in round " << round;
  }
  const LinkTotals totals = proxy->totals();
  proxy.reset();  // which ends the watch
  std::cout << "link faults: " << watcher.watches() << " watches told " << watcher.told()
            << " changes of tiles over " << totals.connections << " connections, " << totals.cuts
            << " cut, " << totals.stalls << " stalled" << std::endl;
  EXPECT_GT(watcher.told(), 0U);
}

}  // namespace
}  // namespace atlas::testing
