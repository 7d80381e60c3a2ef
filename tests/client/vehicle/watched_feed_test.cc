// When a feed with a watch asks the daemon, and when it does not.
#include "client/vehicle/watched_feed.h"

#include <chrono>

#include <gtest/gtest.h>

#include "client/vehicle/atlas_view.h"
#include "tests/client/vehicle/sync_peer.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

const Eigen::Vector2d kPlace_m{5.0, 5.0};
constexpr double kRadius_m = 10.0;
constexpr milliseconds kSoon{300};

class WatchedFeedTest : public ::testing::Test {
 protected:
  WatchedFeedTest() { world_.Set(3, 3, 100); }

  // Of a call: how often it asked for tiles.
  int Ask(const Eigen::Vector2d& position_m, const AroundOptions& options = {}) {
    const int before = peer_.syncs();
    const auto map = view_.Around(position_m, kRadius_m, options);
    EXPECT_TRUE(map) << map.error().message();
    EXPECT_TRUE(map && map->is_current);
    return peer_.syncs() - before;
  }
  // The first call brings what there is, the next one finds that this is all.
  void Settle(const AroundOptions& options = {}) {
    EXPECT_EQ(Ask(kPlace_m, options), 1);
    while (Ask(kPlace_m, options) > 0) {
      ASSERT_LT(peer_.syncs(), 10) << "asks again and again";
    }
  }
  // Until a call asks; how long that took since `start`.
  milliseconds PassesUntilItAsks(Clock::time_point start) {
    while (Ask(kPlace_m) == 0 && Clock::now() - start < seconds(20)) {
    }
    return std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  }

  TinyWorld world_;
  SyncPeer peer_{world_};
  AtlasLink link_{LinkOptions{.connection = peer_.options()}};
  TileStore store_ = *TileStore::Open(TinyAtlas(), {});
  WatchedFeed feed_{link_, {.margin_m = 30.0, .max_silence = seconds(3'600), .watch_pause = kSoon}};
  AtlasView view_{store_, feed_};
};

TEST_F(WatchedFeedTest, AsksForNothingUntilSomethingIsToldToHaveChanged) {
  Settle();
  for (int call = 0; call < 20; ++call) {
    EXPECT_EQ(Ask(kPlace_m), 0) << call;
  }
  EXPECT_EQ(peer_.watches(), 1);
  world_.Set(3, 3, 900);
  peer_.TellChange({0, 3, 3});
  EXPECT_LT(PassesUntilItAsks(Clock::now()), seconds(20));
  EXPECT_EQ(store_.Find({0, 3, 3})->payload_hash,
            world_.tiles().at({0, 3, 3}).encoded.payload_hash);
  EXPECT_EQ(peer_.watches(), 1);
}

TEST_F(WatchedFeedTest, DrivesAsFarAsTheMarginWithoutAsking) {
  world_.Set(25, 3, 50);  // 35 m from the place
  Settle();
  EXPECT_EQ(Ask(kPlace_m + Eigen::Vector2d(29.5, 0.0)), 0);
  EXPECT_NE(store_.Find({0, 25, 3}), nullptr) << "it came before it was asked for";
  EXPECT_EQ(Ask(kPlace_m + Eigen::Vector2d(-29.5, 0.0)), 0);
  EXPECT_EQ(peer_.watches(), 1);
  EXPECT_EQ(Ask(kPlace_m + Eigen::Vector2d(30.5, 0.0)), 1);
  EXPECT_EQ(peer_.watches(), 2) << "where it is now";
}

TEST_F(WatchedFeedTest, AnotherLevelAndOtherSectionsAreAskedFor) {
  Settle();
  AroundOptions coarse;
  coarse.finest_level = 1;
  EXPECT_EQ(Ask(kPlace_m, coarse), 1);
  EXPECT_EQ(peer_.watches(), 2);
  while (Ask(kPlace_m) > 0) {
    ASSERT_LT(peer_.syncs(), 10);
  }
  const int watches = peer_.watches();
  AroundOptions surfaces;
  surfaces.sections = 0b110;  // contributors and surface
  ASSERT_NE(surfaces.sections, kEverySection);
  EXPECT_EQ(Ask(kPlace_m, surfaces), 1);
  EXPECT_EQ(peer_.watches(), watches + 1);
}

TEST_F(WatchedFeedTest, SilenceIsNotBelievedForEver) {
  WatchedFeed feed(link_, {.max_silence = kSoon});
  AtlasView view(store_, feed);
  const auto ask = [&] {
    const int before = peer_.syncs();
    EXPECT_TRUE(view.Around(kPlace_m, kRadius_m)->is_current);
    return peer_.syncs() - before;
  };
  Clock::time_point asked = Clock::now();  // before the last call that did
  for (Clock::time_point call = asked; ask() > 0; call = Clock::now()) {
    asked = call;
  }
  const Clock::time_point quiet = Clock::now();
  while (ask() == 0 && Clock::now() - quiet < seconds(20)) {
  }
  EXPECT_LT(Clock::now() - quiet, seconds(20));
  EXPECT_GE(Clock::now() - asked, kSoon);
}

TEST_F(WatchedFeedTest, WithoutAWatchEveryCallAsksAndAfterAPauseForAWatchToo) {
  peer_.SetWatches(SyncPeer::Watches::kRefused);
  const Clock::time_point start = Clock::now();
  int calls = 0;
  while (peer_.watches() < 2 && Clock::now() - start < seconds(20)) {
    EXPECT_EQ(Ask(kPlace_m), 1);
    ++calls;
  }
  EXPECT_GE(Clock::now() - start, kSoon);
  EXPECT_EQ(peer_.watches(), 2);
  EXPECT_GT(calls, 2);
  peer_.SetWatches(SyncPeer::Watches::kTaken);
  while (Ask(kPlace_m) > 0 && Clock::now() - start < seconds(20)) {
  }
  EXPECT_EQ(peer_.watches(), 3);
  EXPECT_EQ(Ask(kPlace_m), 0);
}

TEST_F(WatchedFeedTest, ADaemonWithoutAWatchToGiveIsNotAskedForOneInAnotherPlaceEither) {
  WatchedFeed feed(link_, {.watch_pause = seconds(3'600)});
  AtlasView view(store_, feed);
  peer_.SetWatches(SyncPeer::Watches::kRefused);
  for (int i = 0; i < 4; ++i) {
    const auto map = view.Around(kPlace_m + Eigen::Vector2d(100.0 * i, 0.0), kRadius_m);
    ASSERT_TRUE(map);
    EXPECT_TRUE(map->is_current);
  }
  EXPECT_EQ(peer_.syncs(), 4);
  EXPECT_EQ(peer_.watches(), 1);
}

TEST_F(WatchedFeedTest, AWatchThatTheDaemonEndsIsNoSilence) {
  Settle();
  peer_.SetWatches(SyncPeer::Watches::kRefused);
  const Clock::time_point start = Clock::now();
  peer_.EndWatch();
  PassesUntilItAsks(start);
  EXPECT_EQ(Ask(kPlace_m), 1);
  while (peer_.watches() < 2 && Clock::now() - start < seconds(20)) {
    EXPECT_EQ(Ask(kPlace_m), 1);
  }
  EXPECT_GE(Clock::now() - start, kSoon);
}

// Nothing of it came, and there is more.
TEST_F(WatchedFeedTest, WhatABudgetCutIsNotAll) {
  AroundOptions small;
  small.budget_bytes = 500;
  for (int call = 1; call <= 3; ++call) {
    const auto map = view_.Around(kPlace_m, kRadius_m, small);
    ASSERT_TRUE(map);
    EXPECT_FALSE(map->is_current);
    EXPECT_EQ(store_.size(), 0u);
    EXPECT_GE(peer_.syncs(), call);
  }
}

// It may be that nothing is told yet.
TEST_F(WatchedFeedTest, AWatchThatHasNotBegunIsNotReliedOn) {
  peer_.SetWatches(SyncPeer::Watches::kLeftWaiting);
  AroundOptions brief;
  brief.deadline = milliseconds(400);
  for (int call = 0; call < 4; ++call) {
    EXPECT_EQ(Ask(kPlace_m, brief), 1) << call;
  }
  EXPECT_EQ(peer_.watches(), 1);
}

// To begin a watch throws away what is on its way: on a slow link that is most of what there is.
TEST_F(WatchedFeedTest, WhatIsOnItsWayComesBeforeAWatchOfAnotherDisc) {
  constexpr double kFar_m = 300.0;
  for (int x = 0; x < 6; ++x) {
    world_.Set(x, 2, 100 + x);
  }
  LinkOptions patient{.connection = peer_.options()};
  patient.connection.request_timeout = seconds(30);
  AtlasLink link(patient);
  WatchedFeed feed(link);
  AtlasView view(store_, feed);
  const auto is_current = [&](double radius_m) {
    AroundOptions brief;
    brief.deadline = milliseconds(400);
    return view.Around(kPlace_m, radius_m, brief)->is_current;
  };
  peer_.FallSilentAfter(6);  // in the middle of the first reply's tiles
  EXPECT_FALSE(is_current(kRadius_m));
  EXPECT_GT(store_.size(), 0U);
  EXPECT_LT(store_.size(), world_.tiles().size());
  for (const double radius_m : {kFar_m, kRadius_m, kFar_m}) {
    EXPECT_FALSE(is_current(radius_m));
  }
  EXPECT_EQ(peer_.watches(), 1);
  peer_.Release();
  const Clock::time_point start = Clock::now();
  while (!is_current(kFar_m) && Clock::now() - start < seconds(20)) {
  }
  EXPECT_EQ(store_.size(), world_.tiles().size());
  EXPECT_EQ(static_cast<std::size_t>(peer_.tiles_sent()), world_.tiles().size()) << "each once";
  is_current(kFar_m);
  EXPECT_EQ(peer_.watches(), 2) << "when nothing is on its way";
}

TEST_F(WatchedFeedTest, WhatTheStoreLostIsAskedForThoughNothingChanged) {
  Settle();
  store_.Remove({0, 3, 3});
  EXPECT_EQ(Ask(kPlace_m), 1);
  EXPECT_NE(store_.Find({0, 3, 3}), nullptr);
}

}  // namespace
}  // namespace atlas
