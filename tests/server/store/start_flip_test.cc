// Single bits of the tables that a start goes by before anything else is looked at, and of their
// indexes: none of what they say keeps it from serving the atlas.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <utility>
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
  const auto add = [&](std::size_t at, std::size_t count) {
    for (std::size_t bit = 0; bit < count; ++bit) {
      bits.push_back((begin + at) * 8 + bit);
    }
  };
  for (std::size_t i = 0; i < 256U * byte(3) + byte(4); ++i) {
    std::size_t at = 256U * byte(8 + 2 * i) + byte(9 + 2 * i);
    std::size_t bytes = byte(at++);
    if (bytes >= 128U) {
      bytes = (bytes & 0x7FU) << 7U | byte(at++);
    }
    bool is_last = !is_table;
    for (std::size_t i_byte = 1; !is_last; ++i_byte) {
      is_last = byte(at) < 128U || i_byte == 9;
      add(at++, i_byte == 9 ? 8 : 7);
    }
    for (std::size_t value = byte(at); value < bytes; ++value) {
      add(at + value, 8);
    }
  }
  return bits;
}

class StartFlipTest : public StoreTest {
 protected:
  void Begin() {
    Open();
    for (const char* const session : {"a", "b", "c"}) {
      NewKeyframe keyframe = MakeKeyframe(7, {{0, 1, 2}, {0, 2, 2}, {0, -300, 7}});
      keyframe.key.session.session = session;
      ASSERT_TRUE(Put(std::move(keyframe)));
    }
    store_.reset();
  }
  std::string Read() const {
    std::ifstream in(Database(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // And nothing beside it.
  void Write(const std::string& file) const {
    std::filesystem::remove_all(options_.directory);
    std::filesystem::create_directories(options_.directory);
    std::ofstream(Database(), std::ios::binary) << file;
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

TEST_F(StartFlipTest, NoValueKeepsAStartFromServing) {
  Begin();
  const std::string intact = Read();
  std::size_t opened = 0;
  for (const auto& [name, step] :
       std::vector<std::pair<const char*, std::size_t>>{{"sessions", 1},
                                                        {"sqlite_autoindex_sessions_1", 1},
                                                        {"dirty_tiles", 2},
                                                        {"dirty_since", 3},
                                                        {"starts", 7},
                                                        {"events", 13},
                                                        {"counters", 13},
                                                        {"session_states", 7},
                                                        {"keyframes", 13},
                                                        {"keyframe_tiles", 13},
                                                        {"poses", 13}}) {
    Write(intact);
    const auto bits = BitsOfValues(intact, testing::RootPage(Database(), name));
    for (std::size_t i = 0; i < bits.size(); i += step) {
      const std::size_t bit = bits[i];
      std::string damaged = intact;
      damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
      Write(damaged);
      const auto store = OpenSqliteStore(options_);
      ASSERT_TRUE(store) << name << ", byte " << bit / 8 % testing::kPageBytes << ", bit "
                         << bit % 8 << ": " << store.error().message();
      ++opened;
    }
  }
  std::printf("%zu bits, and the atlas is served with each\n", opened);
  EXPECT_GT(opened, 900U);
}

// Two may have one number then, and others are not found.
TEST_F(StartFlipTest, NorDoesTheNumberOfACounter) {
  Begin();
  const std::string intact = Read();
  for (std::uint64_t number = 1; number <= 15; ++number) {
    for (std::uint8_t mask = 1; mask < 128; mask = static_cast<std::uint8_t>(2 * mask)) {
      SCOPED_TRACE(std::to_string(number) + " ^ " + std::to_string(mask));
      Write(intact);
      testing::TurnNumber(Database(), "counters", number, mask);
      Open();
      EXPECT_EQ(Check().message(), "");
      EXPECT_EQ(store_->CheckCounters().message(), "");
      store_.reset();
    }
  }
}

// A sum over sessions went by the index, and what it named was not there.
TEST_F(StartFlipTest, ANumberInTheIndexIsMadeAnewByItself) {
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
