// The list of sessions while rows of it are damaged, under a store that stays open: who opens it
// puts them right.
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>

#include "tests/server/store/store_fixture.h"
#include "tests/server/store/turned_bits.h"

namespace atlas {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DamagedSessionsTest : public StoreTest {
 protected:
  void Begin(const std::vector<std::string>& sessions) {
    Open();
    for (const std::string& session : sessions) {
      NewKeyframe keyframe = MakeKeyframe(7, {{0, 1, 2}});
      keyframe.key.session.session = session;
      ASSERT_TRUE(Put(std::move(keyframe)));
    }
  }
  void Spoil(const std::string& sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10'000);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
  void Retract(const std::string& session) {
    ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({{"bus", session}, SessionAction::kRetract, "tester", "why not"},
                            std::move(done));
    }));
  }
  // In pages of that size.
  std::vector<SessionRecord> List(std::uint32_t limit = 1'000) {
    std::vector<SessionRecord> sessions;
    for (SessionKey after;;) {
      const auto page = store_->ListSessions(after, limit);
      EXPECT_TRUE(page) << page.error().message();
      if (!page || page->empty()) {
        return sessions;
      }
      sessions.insert(sessions.end(), page->begin(), page->end());
      after = page->back().key;
    }
  }
  static std::vector<std::string> Names(const std::vector<SessionRecord>& sessions) {
    std::vector<std::string> names;
    for (const SessionRecord& session : sessions) {
      names.push_back(session.key.session + (session.damage == SessionDamage::kRow ? " row"
                                             : session.damage == SessionDamage::kHistory
                                                 ? " history"
                                                 : ""));
    }
    return names;
  }
};

TEST_F(DamagedSessionsTest, ADamagedRowIsOneOfTheListAndTheOthersAreToldAsEver) {
  for (const char* const damage :
       {"state = 2", "keyframes = keyframes + 1", "checksum = checksum + 1", "state = 'gone'"}) {
    SCOPED_TRACE(damage);
    std::filesystem::remove_all(options_.directory);
    Begin({"a", "b", "c", "d"});
    Spoil("UPDATE sessions SET " + std::string(damage) + " WHERE session IN ('b', 'd')");
    for (const std::uint32_t limit : {1U, 2U, 1'000U}) {
      const auto sessions = List(limit);
      ASSERT_THAT(Names(sessions), ElementsAre("a", "b row", "c", "d row"));
      EXPECT_EQ(sessions[2].keyframes, 1U);
      EXPECT_EQ(sessions[2].last_sequence, 7U);
      EXPECT_EQ(sessions[2].reason, "");
      EXPECT_THAT(sessions[1].reason, HasSubstr("(bus/b) is damaged"));
      EXPECT_EQ(sessions[1].keyframes, 0U) << "nothing of it is told";
    }
    store_.reset();
  }
}

TEST_F(DamagedSessionsTest, AStateWhoseHistoryIsDamagedIsToldWithoutItsReason) {
  Begin({"a", "b", "c"});
  Retract("a");
  Retract("b");
  Spoil("UPDATE session_states SET reason = 'other' WHERE session_id = 1 AND state = 3");
  const auto sessions = List();
  EXPECT_THAT(Names(sessions), ElementsAre("a history", "b", "c"));
  EXPECT_EQ(sessions[0].state, SessionState::kRetracted);
  EXPECT_EQ(sessions[0].keyframes, 1U);
  EXPECT_THAT(sessions[0].reason, HasSubstr("wrong checksum"));
  EXPECT_EQ(sessions[1].reason, "why not");
}

// A name that nobody can ask behind, and no frame may have.
TEST_F(DamagedSessionsTest, ANameThatIsNoneIsDamageOfTheIndex) {
  Begin({"a", "b"});
  Spoil("UPDATE sessions SET session = 'b' || char(10) WHERE session = 'b'");
  const auto page = store_->ListSessions({}, 10);
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().code(), StatusCode::kInvalidData);
}

// An index still has what was there, and SQLite writes no row that it does not find in there.
TEST_F(DamagedSessionsTest, ABitOfARowThatItsIndexesLackKeepsNobodyFromStarting) {
  const std::string name = "a session of its own";
  Begin({name, "other"});
  Retract("other");
  store_.reset();
  std::ifstream in(Database(), std::ios::binary);
  const std::string file{std::istreambuf_iterator<char>(in), {}};
  std::size_t places = 0;
  std::size_t listed = 0;
  for (auto at = file.find(name); at != std::string::npos; at = file.find(name, at + 1)) {
    SCOPED_TRACE(++places);
    std::string flipped = file;
    flipped[at] = static_cast<char>(flipped[at] ^ 2);
    std::ofstream(Database(), std::ios::binary) << flipped;
    Open();
    ASSERT_NE(store_, nullptr);
    const auto page = store_->ListSessions({}, 10);
    listed += page ? page->size() : 0U;
    EXPECT_TRUE(page || page.error().code() == StatusCode::kInvalidData) << "of an index";
    store_.reset();
  }
  EXPECT_GT(places, 1U) << "its row and an index";
  EXPECT_GE(listed, 2U) << "its row was told by the index";
}

// As who reads everything back under a running daemon meets it.
TEST_F(DamagedSessionsTest, ABitOfANameThatTurnsUnderTheStoreIsTurnedBackWithItsKeyframe) {
  Begin({"a", "b"});
  Spoil("PRAGMA wal_checkpoint(TRUNCATE)");
  testing::TurnBits(Database(), "sessions", "busb", 3, 1);
  Spoil("UPDATE starts SET number = number");  // what anybody has read is read again
  ASSERT_FALSE(store_->ReadKeyframe(2));
  const auto noted =
      Await<std::uint32_t>([&](auto done) { store_->NoteDamage({2}, std::move(done)); });
  ASSERT_TRUE(noted) << noted.error().message();
  EXPECT_EQ(*noted, 0U) << "it is whole again";
  EXPECT_TRUE(store_->ReadKeyframe(2));
  EXPECT_THAT(Names(List()), ElementsAre("a", "b"));
  EXPECT_TRUE(store_->CheckCounters().ok()) << store_->CheckCounters().message();
}

TEST_F(DamagedSessionsTest, TheNextStartPutsThemRight) {
  Begin({"a", "b"});
  Spoil("UPDATE sessions SET keyframes = 9 WHERE session = 'b'");
  EXPECT_THAT(Names(List()), ElementsAre("a", "b row"));
  std::vector<std::string> told;
  options_.on_repair = [&told](const std::string& what) {
    told.push_back(what);
  };
  Open();
  EXPECT_THAT(told, ElementsAre("tables_repaired: session number 2: its row was damaged"));
  const auto sessions = List();
  EXPECT_THAT(Names(sessions), ElementsAre("a", "b"));
  EXPECT_EQ(sessions[1].keyframes, 1U);
}

}  // namespace
}  // namespace atlas
