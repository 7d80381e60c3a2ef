// Single bits of the table of sessions, and of the index of their names: a start goes by them
// before anything else does, and none of what they say keeps it from serving the atlas.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

#include <gmock/gmock.h>

#include "tests/server/store/store_fixture.h"
#include "tests/server/store/turned_numbers.h"

namespace atlas {
namespace {

using ::testing::UnorderedElementsAre;

// Of bits in a page: those of numbers of rows and of columns. Others say where the next one stands.
std::vector<std::size_t> BitsOfValues(const std::string& file, std::size_t page) {
  const std::size_t begin = (page - 1) * testing::kPageBytes;
  const auto byte = [&](std::size_t at) {
    return static_cast<std::uint8_t>(file.at(begin + at));
  };
  const bool is_table = byte(0) == 13;
  EXPECT_TRUE(is_table || byte(0) == 10) << "a leaf";
  std::vector<std::size_t> bits;
  for (std::size_t i = 0; i < 256U * byte(3) + byte(4); ++i) {
    std::size_t at = 256U * byte(8 + 2 * i) + byte(9 + 2 * i);
    const std::size_t bytes = byte(at++);  // all small: varints of one byte
    EXPECT_LT(bytes, 128U);
    for (std::size_t bit = 0; is_table && bit < 7; ++bit) {
      bits.push_back((begin + at) * 8 + bit);
    }
    at += is_table ? 1 : 0;
    for (std::size_t value = byte(at); value < bytes; ++value) {
      for (std::size_t bit = 0; bit < 8; ++bit) {
        bits.push_back((begin + at + value) * 8 + bit);
      }
    }
  }
  return bits;
}

class SessionFlipTest : public StoreTest {
 protected:
  void Begin() {
    Open();
    for (const char* const session : {"a", "b", "c"}) {
      NewKeyframe keyframe = MakeKeyframe(7, {{0, 1, 2}});
      keyframe.key.session.session = session;
      ASSERT_TRUE(Put(std::move(keyframe)));
    }
    store_.reset();
  }
  Status Check() {
    return store_->CheckIndexes([] { return Status(); });
  }
  Result<std::uint32_t> Repair(TableRepair what) {
    return Await<std::uint32_t>(
        [&](auto done) { store_->RepairTables(what, "tester", std::move(done)); });
  }
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    const auto sessions = store_->ListSessions({}, 100);
    EXPECT_TRUE(sessions) << sessions.error().message();
    for (const SessionRecord& session : sessions.value_or(std::vector<SessionRecord>())) {
      names.push_back(session.key.session + (session.damage == SessionDamage::kNone ? "" : "!"));
    }
    return names;
  }
};

TEST_F(SessionFlipTest, NoValueKeepsAStartFromServing) {
  Begin();
  std::ifstream in(Database(), std::ios::binary);
  const std::string intact{std::istreambuf_iterator<char>(in), {}};
  int opened = 0;
  for (const char* const name : {"sessions", "sqlite_autoindex_sessions_1"}) {
    for (const std::size_t bit : BitsOfValues(intact, testing::RootPage(Database(), name))) {
      std::string damaged = intact;
      damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
      std::filesystem::remove_all(options_.directory);
      std::filesystem::create_directories(options_.directory);
      std::ofstream(Database(), std::ios::binary) << damaged;
      const auto store = OpenSqliteStore(options_);
      ASSERT_TRUE(store) << name << ", byte " << bit / 8 % testing::kPageBytes << ", bit "
                         << bit % 8 << ": " << store.error().message();
      ++opened;
    }
    std::filesystem::remove_all(options_.directory);
    std::filesystem::create_directories(options_.directory);
    std::ofstream(Database(), std::ios::binary) << intact;
  }
  std::printf("%d bits, and the atlas is served with each\n", opened);
  EXPECT_GT(opened, 300);
}

// A sum over sessions went by the index, and what it named was not there.
TEST_F(SessionFlipTest, ANumberInTheIndexIsMadeAnewByItself) {
  Begin();
  testing::TurnBits(Database(), "sqlite_autoindex_sessions_1", {'b', 'u', 's', 'b', 2}, 4, 4);
  Open();
  EXPECT_EQ(Check().code(), StatusCode::kInvalidData);
  const auto repaired = Repair(TableRepair::kIndexes);
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_TRUE(Check().ok()) << Check().message();
  EXPECT_THAT(Names(), UnorderedElementsAre("a", "b", "c"));
}

}  // namespace
}  // namespace atlas
