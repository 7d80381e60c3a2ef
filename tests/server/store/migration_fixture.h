// An atlas of an earlier schema in the place of the store's, before it is opened.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/store/sqlite/schema/schema.h"
#include "tests/server/store/earlier_stores.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {

class EarlierStoreTest : public StoreTest,
                         public ::testing::WithParamInterface<testing::EarlierStore> {
 protected:
  EarlierStoreTest() { options_.new_profile.reset(); }

  void Make() {
    testing::MakeEarlierStore(GetParam(), Database());
    events_before_ = HasTable("events") ? Select("SELECT 1 FROM events").size() : 0;
  }
  std::vector<std::string> Select(const std::string& sql) {
    store_.reset();
    return testing::OpenDatabase(Database()).Select(sql);
  }
  std::int64_t Ask(const std::string& sql) { return std::stoll(Select(sql).at(0).substr(2)); }
  bool HasTable(const std::string& name) {
    return Ask("SELECT count(*) FROM sqlite_master WHERE name = '" + name + "'") != 0;
  }
  std::vector<std::int64_t> Ids() { return store_->ListKeyframeIds(0, 1'000).value(); }

  // Of the open store: every row is read, every checksum and every sum verified.
  void ExpectSound() {
    const Status counted = store_->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
    const Status compacted = store_->CheckCompactions();
    EXPECT_TRUE(compacted.ok()) << compacted.message();
    const auto sessions = store_->ListSessions({}, 1'000);
    ASSERT_TRUE(sessions.has_value()) << sessions.error().message();
    EXPECT_GE(sessions->size(), 2u);
    for (const SessionRecord& session : *sessions) {
      const Status status = store_->CheckSession(session.key);
      EXPECT_TRUE(status.ok()) << status.message();
    }
    EXPECT_GE(Ids().size(), 3u);
    for (const std::int64_t id : Ids()) {
      const auto keyframe = store_->ReadKeyframe(id);
      ASSERT_TRUE(keyframe.has_value()) << keyframe.error().message();
      EXPECT_FALSE(keyframe->footprint.empty());
      EXPECT_TRUE(store_->ReadKeyframeBlob(id).has_value());
    }
    const auto tiles = store_->ListTiles(-1, 1'000);
    ASSERT_TRUE(tiles.has_value()) << tiles.error().message();
    for (const TileSummary& tile : *tiles) {
      EXPECT_TRUE(store_->ReadTile(tile.id).has_value());
    }
    const auto events = store_->ListEvents(0, 100);
    ASSERT_TRUE(events.has_value()) << events.error().message();
    EXPECT_EQ(events->size(), events_before_ + 1) << "marks were found wanting";
  }

  std::size_t events_before_ = 0;  // the upgrade
};

}  // namespace atlas
