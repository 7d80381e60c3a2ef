// Single bits of an atlas's file, turned while nobody has it open. Whatever the store then says is
// what it said before, or an error; what it says no more is noticed by its checks.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <random>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

constexpr int kFlips = 1'000;

// What was asked, and the answer as text; damage as kDamaged.
using Answers = std::map<std::string, std::string>;
constexpr const char* kDamaged = "damaged";

std::string HashOf(ByteSpan bytes) {
  return StrCat(bytes.size(), " bytes ", Hash64(bytes));
}

std::string TextOf(const KeyframeRecord& record) {
  return StrCat(record.id, " ", record.key, " ", record.time_ms, " ", record.pose.x_um, " ",
                record.pose.y_um, " ", record.pose.z_um, " ",
                static_cast<int>(record.session_state));
}

std::string TextOf(const TileSources& sources) {
  std::string text = sources.is_whole ? "whole:" : ":";
  for (const KeyframeRecord& record : sources.keyframes) {
    text += TextOf(record) + ",";
  }
  for (const std::int64_t gone : sources.gone) {
    text += StrCat(" -", gone);
  }
  return text;
}

// kFoundAtOnce: wrong answers that are right again, or damage, after what a daemon does right after
// it was started. kNamedAtOnce: it says then that they may be wrong until a repair.
enum class Outcome {
  kHarmless,
  kRefused,
  kAnswersDamaged,
  kFoundAtOnce,
  kNamedAtOnce,
  kNoticedByChecks,
  kUnnoticed,
};

class FlipTest : public StoreTest {
 protected:
  static std::vector<TileId> TilesOf(std::uint32_t sequence) {
    const auto x = static_cast<std::int32_t>(sequence / 4);
    return {{0, x, 0}, {0, x + 1, 0}, {0, x, -1}};
  }

  // Two sessions, corrected poses, one retracted and restored, every tile built and some dirty.
  void Fill() {
    Open();
    std::mt19937 random(5);
    for (std::uint32_t sequence = 1; sequence <= 120; ++sequence) {
      NewKeyframe keyframe = MakeKeyframe(sequence, TilesOf(sequence));
      keyframe.key.session.session = sequence % 3 == 0 ? "night" : "day";
      keyframe.blob.resize(2'000 + random() % 9'000);
      for (std::uint8_t& byte : keyframe.blob) {
        byte = static_cast<std::uint8_t>(random());
      }
      ASSERT_TRUE(Put(std::move(keyframe)));
    }
    for (const std::uint32_t sequence : {3U, 6U, 9U, 60U}) {
      ASSERT_TRUE(
          Update({{{{"bus", "night"}, sequence}, PoseAt(sequence), TilesOf(sequence + 5)}}));
    }
    for (const SessionAction action : {SessionAction::kRetract, SessionAction::kRestore}) {
      ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
        store_->ChangeSession({{"bus", "night"}, action, "tester", "why not"}, std::move(done));
      }));
    }
    Build(random);
    ASSERT_TRUE(Put(MakeKeyframe(200, {{0, 3, 0}, {0, 50, 50}})));
    keyframes_ = store_->ListKeyframeIds(0, 1'000).value();
    const auto tiles = store_->ListTiles(-1, 1'000).value();
    for (const TileSummary& tile : tiles) {
      tiles_.push_back(tile.id);
    }
    reference_ = Ask();
    store_.reset();
  }

  void Build(std::mt19937& random) {
    while (true) {
      const ClaimResult claimed = Claim();
      if (claimed.claims.empty()) {
        return;
      }
      for (const TileClaim& claim : claimed.claims) {
        TileContent content = Content(static_cast<std::uint8_t>(random()));
        content.payload_hash = random();
        content.blob.resize(1'000 + random() % 20'000, static_cast<std::uint8_t>(random()));
        ASSERT_TRUE(Finish(claim, content));
      }
    }
  }

  template <typename T, typename Text>
  static std::string Answer(const Result<T>& result, Text text) {
    if (result) {
      return text(*result);
    }
    return result.error().code() == StatusCode::kInvalidData
               ? kDamaged
               : StrCat("error ", result.error().message());
  }

  // Everything there is to ask, by what is known of the reference.
  Answers Ask() {
    Answers answers;
    for (const std::int64_t id : keyframes_) {
      answers[StrCat("keyframe ", id)] =
          Answer(store_->ReadKeyframe(id), [](const StoredKeyframe& stored) {
            std::string text = TextOf(stored.record);
            for (const TileId& tile : stored.footprint) {
              text += StrCat(" ", tile);
            }
            return text;
          });
      answers[StrCat("blob ", id)] =
          Answer(store_->ReadKeyframeBlob(id), [](const Bytes& blob) { return HashOf(blob); });
    }
    for (const TileId& id : tiles_) {
      answers[StrCat("tile ", id)] =
          Answer(store_->ReadTile(id), [](const std::optional<StoredTile>& tile) {
            return tile ? StrCat(tile->revision, " ", tile->payload_hash, " ", HashOf(tile->blob))
                        : std::string("none");
          });
      if (id.level == 0) {
        answers[StrCat("sources ", id)] = Answer(
            store_->GatherTile(id, 0), [](const TileSources& sources) { return TextOf(sources); });
        answers[StrCat("former sources ", id)] =
            Answer(store_->GatherTileAt(id, 60),
                   [](const TileSources& sources) { return TextOf(sources); });
      }
    }
    answers["tiles"] =
        Answer(store_->ListTiles(-1, 1'000), [](const std::vector<TileSummary>& tiles) {
          std::string text;
          for (const TileSummary& tile : tiles) {
            text += StrCat(tile.id, " ", tile.revision, " ", tile.payload_hash, " ",
                           tile.blob_bytes, ",");
          }
          return text;
        });
    answers["keyframes"] =
        Answer(store_->ListKeyframeIds(0, 1'000), [](const std::vector<std::int64_t>& ids) {
          std::string text;
          for (const std::int64_t id : ids) {
            text += StrCat(id, " ");
          }
          return text;
        });
    answers["sessions"] =
        Answer(store_->ListSessions({}, 1'000), [](const std::vector<SessionRecord>& sessions) {
          std::string text;
          for (const SessionRecord& session : sessions) {
            if (session.damage != SessionDamage::kNone) {
              return std::string(kDamaged);
            }
            text += StrCat(session.key, " ", static_cast<int>(session.state), " ",
                           session.keyframes, " ", session.last_sequence, ",");
          }
          return text;
        });
    answers["marks"] = Answer(store_->ReadDirtyState(), [](const DirtyState& state) {
      return StrCat(state.revision, " ", state.dirty_tiles, " ", state.oldest_since);
    });
    answers["events"] = Answer(store_->ListEvents(0, 1'000), [](const std::vector<Event>& events) {
      std::string text;
      for (const Event& event : events) {
        if (event.is_damaged) {
          return std::string(kDamaged);
        }
        text += StrCat(event.id, " ", event.author, " ", event.subject, " ", event.detail, ",");
      }
      return text;
    });
    return answers;
  }

  // What was mended when the atlas was opened is an event of its own.
  static bool IsNamed(const std::string& events, const std::string& before) {
    return events.starts_with(before) &&
           events.find(StrCat(" ", kAtlasItself, " "), before.size()) != std::string::npos;
  }

  bool ChecksNotice() {
    for (const Status& status :
         {store_->CheckCounters(), store_->CheckCompactions(), store_->CheckSession({"bus", "day"}),
          store_->CheckSession({"bus", "night"})}) {
      if (status.code() == StatusCode::kInvalidData) {
        return true;
      }
    }
    return false;
  }

  // As a daemon does before anything else, in the background. Of damaged rows none is made anew:
  // then it has said that answers may be wrong.
  bool MendsIndexes() {
    said_.clear();
    const Status found = store_->CheckIndexes([] { return Status(); });
    if (found.ok()) {
      return false;
    }
    EXPECT_EQ(found.code(), StatusCode::kInvalidData) << found.message();
    const auto repaired = Await<std::uint32_t>([&](auto done) {
      store_->RepairTables(TableRepair::kIndexes, kAtlasItself, std::move(done));
    });
    EXPECT_TRUE(repaired || repaired.error().code() == StatusCode::kInvalidData)
        << repaired.error().message();
    said_ = found.message() + (repaired ? "" : "; " + repaired.error().message());
    mended_ += repaired ? 1 : 0;
    only_said_ += repaired ? 0 : 1;
    return repaired.has_value();
  }

  // Of what no repair changes.
  std::string FirstWrong(const Answers& answers) const {
    for (const auto& [question, answer] : answers) {
      if (question != "marks" && question != "events" && answer != kDamaged &&
          answer != reference_.at(question)) {
        return StrCat(question, ": ", answer.substr(0, 200));
      }
    }
    return "";
  }

  Outcome OutcomeOf(std::string& what) {
    auto store = OpenSqliteStore(options_);
    if (!store) {
      EXPECT_TRUE(store.error().code() == StatusCode::kInvalidData ||
                  store.error().code() == StatusCode::kUnsupported)
          << store.error().message();
      what = store.error().message();
      return Outcome::kRefused;
    }
    store_ = std::move(*store);
    const Answers answers = Ask();
    const bool is_noticed = ChecksNotice();
    const bool is_found = MendsIndexes();
    const std::string left = is_found ? FirstWrong(Ask()) : "";
    store_.reset();
    EXPECT_EQ(left, "") << "after the indexes were made anew";
    Outcome outcome = Outcome::kHarmless;
    for (const auto& [question, answer] : answers) {
      if (answer == kDamaged) {
        outcome = std::max(outcome, Outcome::kAnswersDamaged);
      } else if ((question == "events" || question == "marks") &&
                 IsNamed(answers.at("events"), reference_.at("events"))) {
        outcome = std::max(outcome, Outcome::kAnswersDamaged);
      } else if (answer != reference_.at(question)) {
        what = question + ": " + answer.substr(0, 200) + " instead of " +
               reference_.at(question).substr(0, 200);
        outcome = std::max(outcome, is_found         ? Outcome::kFoundAtOnce
                                    : !said_.empty() ? Outcome::kNamedAtOnce
                                    : is_noticed     ? Outcome::kNoticedByChecks
                                                     : Outcome::kUnnoticed);
      }
    }
    return outcome;
  }

  std::vector<std::int64_t> keyframes_;
  std::vector<TileId> tiles_;
  Answers reference_;
  std::string said_;   // of the indexes
  int mended_ = 0;     // indexes that were made anew at once
  int only_said_ = 0;  // that were not, as rows are damaged
};

TEST_F(FlipTest, NothingElseIsSaidThanWasWritten) {
  Fill();
  std::ifstream in(Database(), std::ios::binary);
  const std::string intact((std::istreambuf_iterator<char>(in)), {});
  std::mt19937_64 random(17);
  std::map<Outcome, int> outcomes;
  const auto flips = static_cast<int>(testing::Scaled(kFlips));
  for (int i = 0; i < flips; ++i) {
    const std::uint64_t bit = random() % (intact.size() * 8);
    std::string damaged = intact;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    for (const auto& entry : std::filesystem::directory_iterator(options_.directory)) {
      std::filesystem::remove(entry);
    }
    std::ofstream(Database(), std::ios::binary) << damaged;
    std::string what;
    const Outcome outcome = OutcomeOf(what);
    ++outcomes[outcome];
    if (outcome >= Outcome::kFoundAtOnce || outcome == Outcome::kRefused) {
      std::printf("bit %llu (page %llu, byte %llu): %d: %s (%s)\n",
                  static_cast<unsigned long long>(bit),
                  static_cast<unsigned long long>(bit / 8 / 8192 + 1),
                  static_cast<unsigned long long>(bit / 8 % 8192), static_cast<int>(outcome),
                  what.c_str(), said_.c_str());
    }
  }
  std::printf(
      "%d flips in %zu bytes: %d harmless, %d refused, %d named as damage, %d found and mended at "
      "once, %d named at once, %d noticed by checks alone, %d unnoticed; %d times indexes were "
      "made anew, %d times "
      "only named\n",
      flips, intact.size(), outcomes[Outcome::kHarmless], outcomes[Outcome::kRefused],
      outcomes[Outcome::kAnswersDamaged], outcomes[Outcome::kFoundAtOnce],
      outcomes[Outcome::kNamedAtOnce], outcomes[Outcome::kNoticedByChecks],
      outcomes[Outcome::kUnnoticed], mended_, only_said_);
  // Those of the file's header, of its schema, and of how rows that a start needs are laid out.
  EXPECT_LE(outcomes[Outcome::kRefused], 2 + flips / 1'000);
  EXPECT_EQ(outcomes[Outcome::kUnnoticed], 0);
  EXPECT_EQ(outcomes[Outcome::kNoticedByChecks], 0) << "by nobody but who verifies";
}

}  // namespace
}  // namespace atlas
