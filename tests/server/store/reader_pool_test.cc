#include "server/store/sqlite/connection/reader_pool.h"

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

class ReaderPoolTest : public StoreTest {};

// A constraint that is checked at the end of a transaction keeps it from ending.
TEST_F(ReaderPoolTest, AConnectionWhoseSnapshotCannotEndIsNotLentAgain) {
  Open();
  ReaderPool readers({Database(), DatabaseOptions::Mode::kReadOnly}, 1);
  const auto read = [&](const char* before) {
    return readers.Run<std::int64_t>([before](Connection& connection) {
      connection.Execute(before);
      return Result<std::int64_t>(connection.Ask("SELECT count(*) FROM counters"));
    });
  };
  const auto first = read(
      "COMMIT; PRAGMA foreign_keys = ON; CREATE TEMP TABLE a (id INTEGER PRIMARY KEY);"
      "CREATE TEMP TABLE b (id REFERENCES a (id) DEFERRABLE INITIALLY DEFERRED);"
      "BEGIN; INSERT INTO b VALUES (1)");
  ASSERT_TRUE(first) << first.error().message();
  for (int i = 0; i < 2; ++i) {  // the limit counts the ones that are open
    const auto next = read("");
    ASSERT_TRUE(next) << next.error().message();
    EXPECT_EQ(*next, *first);
  }
  Connection copier({Database(), DatabaseOptions::Mode::kReadWrite});
  EXPECT_TRUE(copier.EmptyLog()) << "its snapshot is still there";
}

}  // namespace
}  // namespace atlas
