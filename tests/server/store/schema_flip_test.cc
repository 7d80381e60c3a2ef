// Every single bit of the pages that the schema lies on, turned: SQLite makes of them what it made,
// or no file is read by it, or a verification finds what it made of it. And a daemon that starts
// goes on as if nothing had been, or refuses.
#include <fstream>
#include <iterator>
#include <random>

#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/transactions/counter_check.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/store/schema_fixture.h"
#include "tests/server/store/turned_bits.h"

namespace atlas {
namespace {

constexpr std::size_t kHeader = 100;  // of the file: before the first page's own
constexpr int kBits = 8;
constexpr std::uint32_t kFewestStarts = 200;  // of 1,986 starts 112 were refused

class SchemaFlipTest : public SchemaTest {
 protected:
  void SetUp() override {
    Fill(3);
    store_.reset();
    std::ifstream in(Database(), std::ios::binary);
    intact_ = {std::istreambuf_iterator<char>(in), {}};
    rows_ = RowsOf(Database());
    structure_ = Structure(Database());
  }

  // Those of the first page that are not free: all of the schema lies there.
  std::vector<std::size_t> BytesOfSchema() const {
    const auto number = [this](std::size_t at) {
      return std::size_t{static_cast<std::uint8_t>(intact_[at])} << 8U |
             static_cast<std::uint8_t>(intact_[at + 1]);
    };
    EXPECT_EQ(intact_[kHeader], 13) << "a leaf";
    const std::size_t cells = kHeader + 8 + 2 * number(kHeader + 3);
    const std::size_t content = number(kHeader + 5);
    std::vector<std::size_t> bytes;
    for (std::size_t at = kHeader; at < testing::kPageBytes; ++at) {
      if (at < cells || at >= content) {
        bytes.push_back(at);
      }
    }
    return bytes;
  }

  void WriteTurned(const std::filesystem::path& file, std::size_t byte, int bit) const {
    std::string turned = intact_;
    turned[byte] = static_cast<char>(turned[byte] ^ (1 << bit));
    std::ofstream(file, std::ios::binary) << turned;
  }

  // What SQLite makes of it, and where; of the text only what it does not tell otherwise.
  static std::string StructureOf(Connection& connection) {
    std::string structure;
    for (const char* const sql :
         {"SELECT lower(quote(l.name) || quote(l.type) || l.wr || l.strict || x.cid || "
          "quote(x.name) || quote(x.type) || x.\"notnull\" || quote(x.dflt_value) || x.pk || "
          "x.hidden) FROM pragma_table_list l, pragma_table_xinfo(l.name) x "
          "WHERE l.schema = 'main' ORDER BY 1",
          "SELECT lower(quote(l.name) || quote(i.name) || i.\"unique\" || i.origin || i.partial || "
          "x.seqno || x.cid || quote(x.name) || x.\"desc\" || quote(x.coll) || x.key) "
          "FROM pragma_table_list l, pragma_index_list(l.name) i, pragma_index_xinfo(i.name) x "
          "WHERE l.schema = 'main' ORDER BY 1",
          "SELECT quote(type) || quote(name) || quote(tbl_name) || rootpage || lower(substr(sql, "
          "max(instr(lower(sql), 'check'), instr(lower(sql), 'where')), 20)) FROM sqlite_master "
          "WHERE sql LIKE '%check%' OR sql LIKE '%where%' ORDER BY 1",
          "SELECT quote(type) || quote(name) || quote(tbl_name) || rootpage FROM sqlite_master "
          "ORDER BY 1"}) {
      Query row = connection.Prepare(sql);
      while (row.Step()) {
        row.Rewind();
        structure += row.Text() + "\n";
      }
    }
    return structure;
  }
  static std::string Structure(const std::filesystem::path& file) {
    Connection connection({file, DatabaseOptions::Mode::kUntouched, 256, 0});
    return StructureOf(connection);
  }

  enum class Outcome { kSame, kRefused, kVerified, kUnnoticed };
  // As whoever reads a file.
  Outcome Read(const std::filesystem::path& file) const {
    try {
      Connection connection({file, DatabaseOptions::Mode::kUntouched, 256, 0, true});
      AddRowHash(connection);
      const Snapshot snapshot(connection);
      if (const auto identity = ReadIdentity(connection); !identity) {
        return OutcomeOf(identity.error());
      }
      const std::string structure = StructureOf(connection);
      if (structure == structure_) {
        return Outcome::kSame;
      }
      const bool is_noticed = !CheckCounters(connection).ok();
      EXPECT_TRUE(is_noticed) << structure;
      return is_noticed ? Outcome::kVerified : Outcome::kUnnoticed;
    } catch (const std::exception& error) {
      return OutcomeOf(StatusFromException(error));
    }
  }
  static Outcome OutcomeOf(const Status& status) {
    EXPECT_TRUE(CodeIsOfDamage(status)) << status.message();
    return CodeIsOfDamage(status) ? Outcome::kRefused : Outcome::kUnnoticed;
  }
  static bool CodeIsOfDamage(const Status& status) {
    return status.code() == StatusCode::kInvalidData || status.code() == StatusCode::kUnsupported;
  }

  std::string intact_;
  std::map<std::string, std::string> rows_;
  std::string structure_;
};

// One bit of each byte, with ATLAS_TEST_SCALE=8 all of them.
TEST_F(SchemaFlipTest, EachIsRefusedOrHarmless) {
  std::map<Outcome, int> outcomes;
  const auto bits = std::min(kBits, static_cast<int>(testing::Scaled(1)));
  for (const std::size_t byte : BytesOfSchema()) {
    for (int i = 0; i < bits; ++i) {
      const int bit = static_cast<int>(byte * 5 + static_cast<std::size_t>(i)) % kBits;
      WriteTurned(backup(), byte, bit);
      const Outcome outcome = Read(backup());
      ++outcomes[outcome];
      EXPECT_NE(outcome, Outcome::kUnnoticed) << "bit " << bit << " of byte " << byte;
    }
  }
  EXPECT_GT(outcomes[Outcome::kRefused], outcomes[Outcome::kSame]);
  RecordProperty("same", outcomes[Outcome::kSame]);
  RecordProperty("refused", outcomes[Outcome::kRefused]);
  RecordProperty("verified", outcomes[Outcome::kVerified]);
}

TEST_F(SchemaFlipTest, AStartGoesOnAsIfNothingHadBeenOrRefuses) {
  const std::vector<std::size_t> bytes = BytesOfSchema();
  std::mt19937_64 random(3);
  int opened = 0;
  int refused = 0;
  const std::uint32_t rounds = std::max(kFewestStarts, testing::Scaled(kFewestStarts));
  for (std::uint32_t i = 0; i < rounds && !HasFailure(); ++i) {
    const std::size_t byte = bytes[random() % bytes.size()];
    const int bit = static_cast<int>(random() % kBits);
    SCOPED_TRACE("bit " + std::to_string(bit) + " of byte " + std::to_string(byte));
    std::filesystem::remove_all(options_.directory);
    std::filesystem::create_directories(options_.directory);
    WriteTurned(Database(), byte, bit);
    auto store = OpenSqliteStore(options_);
    if (!store) {
      EXPECT_TRUE(CodeIsOfDamage(store.error())) << store.error().message();
      ++refused;
      continue;
    }
    store_ = *std::move(store);
    const Status checked = CheckAll();
    store_.reset();
    if (checked.ok()) {
      ++opened;
      EXPECT_EQ(Structure(Database()), structure_);
      EXPECT_EQ(RowsOf(Database()), rows_);
    }
  }
  EXPECT_GT(opened, 5 * refused) << "the text is known";
  RecordProperty("opened", opened);
  RecordProperty("refused", refused);
}

}  // namespace
}  // namespace atlas
