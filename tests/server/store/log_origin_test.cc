// A database that was replaced by an older copy, or cut off, beside the log of a daemon that was
// killed: SQLite would make one of the two.
#include "core/base/hash.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/log_pages.h"
#include "tests/server/store/missing_commits_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

class LogOriginTest : public MissingCommitsTest {
 protected:
  void PutLarge(std::uint32_t first, std::uint32_t count) {
    for (std::uint32_t i = first; i < first + count; ++i) {
      const auto put = Put(Keyframe(i, 30'000));
      ASSERT_TRUE(put) << put.error().message();
    }
  }
  void CloseAndOpen() {
    Open();
    store_.reset();
    Open();
  }
  // All of the log is copied, and the next commit begins another one.
  void CopyLog() {
    Connection copier({Database(), DatabaseOptions::Mode::kReadWrite});
    ASSERT_GT(copier.CopyLog().value_or(0), 0);
  }
  // And nothing is changed.
  void ExpectRefused(const Files& files, StatusCode code, const std::string& why) {
    PutThere(files);
    const auto refused = OpenSqliteStore(options_);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code(), code);
    EXPECT_NE(refused.error().message().find(why), std::string::npos) << refused.error().message();
    EXPECT_TRUE(Look() == files) << "something was changed";
    EXPECT_TRUE(told_.empty()) << told_;
  }
  void ExpectServed(const Files& files, std::uint64_t keyframes) {
    PutThere(files);
    Open();
    ExpectNothingMissing();
    EXPECT_EQ(store_->ReadCounts()->keyframes, keyframes);
    const Status counted = store_->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
  }
  static Files With(Files files, const std::string& name, const Bytes& bytes) {
    files[name] = bytes;
    return files;
  }
  static Files Without(Files files, const std::string& name) {
    files.erase(name);
    return files;
  }
};

TEST_F(LogOriginTest, AnOlderCopyIsNotMixedWithTheLog) {
  Open();
  PutMany(0, 2);
  store_.reset();
  const Bytes older = ReadFile(Database());
  CloseAndOpen();
  PutMany(2, 3);
  CloseAndOpen();
  PutMany(5, 3);
  const NotedRevision lost = *ReadRevisionNote(Note());
  const Files killed = Look();
  const Files mixed = With(killed, "atlas.db", older);
  ExpectRefused(mixed, StatusCode::kConflict, "an older copy was put in its place");
  ExpectServed(killed, 8);
  PutThere(Without(mixed, "atlas.db-wal"));
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 2U);
  ExpectNoticed(lost);
}

// What is copied of it is in the database before it begins anew.
TEST_F(LogOriginTest, NorWithALogThatBeganWhileTheDaemonRan) {
  Open();
  PutMany(0, 2);
  CloseAndOpen();
  PutMany(2, 3);
  const Files early = Look();
  const Bytes older = early.at("atlas.db");
  ExpectServed(early, 5);
  PutThere(early);
  Open();
  PutMany(5, 3);
  const std::uint64_t first = ReadLogSalts(Log());
  CopyLog();
  const Files copied = Look();
  PutMany(8, 3);
  ASSERT_NE(ReadLogSalts(Log()), first);
  const Files killed = Look();
  ExpectRefused(With(killed, "atlas.db", older), StatusCode::kConflict, "an older copy");
  ExpectServed(killed, 11);
  ExpectServed(With(killed, "atlas.db", copied.at("atlas.db")), 11);
  ExpectServed(copied, 8);
  ExpectServed(With(copied, "atlas.db", older), 8);  // the log goes on from both
}

// A daemon that is killed again and again goes on with one log.
TEST_F(LogOriginTest, TheOriginOfALogIsKnownBehindAKill) {
  Open();
  PutMany(0, 2);
  store_.reset();
  const Bytes older = ReadFile(Database());
  Open();
  PutMany(2, 3);
  CloseAndOpen();
  PutMany(5, 3);
  for (std::uint32_t i = 8; i < 11; ++i) {
    const Files killed = Look();
    ExpectRefused(With(killed, "atlas.db", older), StatusCode::kConflict, "an older copy");
    ExpectServed(killed, i);
    PutMany(i, 1);
  }
}

// Behind a power cut, say: what the log itself tells.
TEST_F(LogOriginTest, WithoutTheNotePagesThatAreNowhereAreNoticed) {
  Open();
  PutLarge(0, 2);
  store_.reset();
  const Bytes older = ReadFile(Database());
  Open();
  PutLarge(2, 3);
  CloseAndOpen();
  PutLarge(5, 3);
  const Files killed = Without(Look(), "atlas.db-revision");
  ExpectRefused(With(killed, "atlas.db", older), StatusCode::kInvalidData, "neither in its file");
  Bytes cut = killed.at("atlas.db");
  cut.resize(cut.size() - cut.size() / 4);
  ExpectRefused(With(killed, "atlas.db", cut), StatusCode::kInvalidData, "neither in its file");
  ExpectServed(killed, 8);
}

// The reverse: what the database has, the log would undo.
TEST_F(LogOriginTest, AnOlderLogIsNotMixedWithTheDatabase) {
  Open();
  PutMany(0, 3);
  const Bytes log = ReadFile(Log());
  PutMany(3, 3);
  store_.reset();
  const Files closed = Look();
  ExpectRefused(With(closed, "atlas.db-wal", log), StatusCode::kConflict, "ends at revision 3");
  ExpectServed(closed, 6);
}

TEST_F(LogOriginTest, NorAreTwoAtlases) {
  Open();
  PutMany(0, 3);
  const Files killed = Look();
  PutThere({});
  options_.new_atlas_id = {9, 9, 9};
  Open();
  PutMany(0, 1);
  store_.reset();
  ExpectRefused(With(killed, "atlas.db", ReadFile(Database())), StatusCode::kConflict,
                "another atlas");
}

// A kill in the middle of copying the log, which copies the first page first: without its log the
// file is shorter than it says.
TEST_F(LogOriginTest, WhoeverMovedTheLogAwayIsToldToPutItBack) {
  Open();
  PutLarge(0, 2);
  CloseAndOpen();
  const Bytes short_one = ReadFile(Database());
  PutLarge(2, 3);
  Files killed = Look();
  CopyLog();
  const Bytes copied = ReadFile(Database());
  killed["atlas.db"].assign(copied.begin(),
                            copied.begin() + static_cast<std::ptrdiff_t>(short_one.size()));
  const std::string advice = "if it was moved away after a kill, put it back";
  ExpectRefused(Without(killed, "atlas.db-wal"), StatusCode::kInvalidData, advice);
  ExpectServed(killed, 5);
  store_.reset();
  Files longer = Look();
  longer["atlas.db"].resize(longer["atlas.db"].size() * 2);
  ExpectRefused(longer, StatusCode::kInvalidData, advice);
  PutThere(Without(longer, "atlas.db-revision"));
  EXPECT_EQ(OpenSqliteStore(options_).error().message().find(advice), std::string::npos);
}

// Whoever refuses for another reason does not copy the log either.
TEST_F(LogOriginTest, AStartThatIsRefusedLeavesTheLog) {
  Open();
  PutLarge(0, 3);
  store_.reset();
  Open();
  PutMany(3, 3);
  Files killed = Look();
  killed["atlas.db"].resize(killed["atlas.db"].size() * 2);
  ExpectRefused(killed, StatusCode::kInvalidData, "its file has");
}

TEST_F(LogOriginTest, ANoteOfTheFirstVersionTellsNoOrigin) {
  Open();
  PutMany(0, 5);
  const NotedRevision noted = *ReadRevisionNote(Note());
  const Files killed = Look();
  ByteWriter writer;
  for (const char letter : std::string("RAAREV01")) {
    writer.U8(static_cast<std::uint8_t>(letter));
  }
  writer.Raw(noted.atlas_id);
  writer.U64(noted.epoch);
  writer.U64(noted.revision);
  writer.U64(Hash64(writer.bytes()));
  Files earlier = With(killed, "atlas.db-revision", writer.bytes());
  PutThere(earlier);
  const auto read = ReadRevisionNote(Note());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->revision, noted.revision);
  EXPECT_EQ(read->epoch, noted.epoch);
  EXPECT_EQ(read->log.salts, 0U);
  ExpectServed(earlier, 5);
  PutThere(Without(earlier, "atlas.db-wal"));
  Open();
  ExpectNoticed(noted);
}

}  // namespace
}  // namespace atlas
