#include "tests/server/service/property/atlas_player.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"
#include "server/store/await.h"
#include "server/store/sqlite/sqlite_store.h"

namespace atlas::testing {
namespace {

constexpr std::int64_t kNow_ms = 1'700'000'000'000;
constexpr std::uint32_t kManyTiles = 100'000;
constexpr std::uint32_t kManyKeyframes = 100'000;

Patience Long() {
  return {std::chrono::seconds(60), {}};
}

std::string NameOf(std::uint64_t key) {
  const auto id = TileId::FromKey(key);
  return id ? StrCat("tile ", *id) : StrCat("key ", key);
}

// What an answer says beside its revision.
std::string TextOf(const PutKeyframeResult& put) {
  return StrCat(put.is_duplicate ? "duplicate" : "new", ", ", put.tiles_marked, " tiles marked",
                put.judgement ? StrCat(", session now in state ", int(put.judgement->state)) : "");
}
std::string TextOf(const PoseBatchResult& batch) {
  return StrCat(batch.updated, " poses updated, ", batch.tiles_marked, " tiles marked");
}
std::string TextOf(const SessionChangeResult& change) {
  return StrCat(change.is_changed ? "now" : "still", " in state ", int(change.state), ", ",
                change.tiles_marked, " tiles marked, ", change.keyframes, " keyframes deleted");
}
// What does not depend on which of several keyframes came first.
Result<PutKeyframeResult> WithoutOrder(const Result<PutKeyframeResult>& put) {
  return put ? Result<PutKeyframeResult>({put->is_duplicate, 0, 0, std::nullopt}) : put;
}
template <typename T>
std::string TextOf(const Result<T>& answer) {
  return answer ? TextOf(*answer) : std::string(StatusCodeName(answer.error().code()));
}

}  // namespace

AtlasPlayer::AtlasPlayer(const AtlasScript& script,
                         std::filesystem::path directory,
                         PlayCounts& counts)
    : script_(script), directory_(std::move(directory)), counts_(counts), model_(script) {}

AtlasPlayer::~AtlasPlayer() {
  Close();
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

std::string AtlasPlayer::Play() {
  ++counts_.cases;
  Open(script_.setup);
  for (std::size_t i = 0; i < script_.steps.size() && failure_.empty(); ++i) {
    PlayStep(script_.steps[i]);
    ++counts_.steps;
    if (!failure_.empty()) {
      return StrCat("step ", i, ": ", failure_);
    }
  }
  CompareNotes();
  if (script_.is_verified) {
    Verify();
  }
  return failure_;
}

bool AtlasPlayer::Fail(bool is_wrong, const std::function<std::string()>& what) {
  if (is_wrong && failure_.empty()) {
    failure_ = what();
  }
  return is_wrong;
}

template <typename T>
bool AtlasPlayer::CheckAnswer(const char* what,
                              const Result<T>& answer,
                              const Result<T>& expected) {
  counts_.refused += expected ? 0u : 1u;
  return !Fail(TextOf(answer) != TextOf(expected), [&] {
    return StrCat(what, ": ", TextOf(answer), ", expected: ", TextOf(expected),
                  answer ? "" : "; " + answer.error().message());
  });
}

void AtlasPlayer::Open(const DaemonSetup& setup) {
  Close();
  SqliteStoreOptions options;
  options.directory = directory_ / "data";
  options.new_profile = script_.profile;
  options.max_group = setup.max_group;
  options.max_readers = setup.max_readers;
  auto store = OpenSqliteStore(options);
  if (Fail(!store, [&] { return store.error().message(); })) {
    return;
  }
  store_ = std::move(*store);
  ServiceOptions service;
  service.fusion.workers = setup.workers;
  service.fusion.tiles_per_claim = setup.tiles_per_claim;
  service.fusion.building = setup.building;
  service.fusion.building.survey_files.directory = directory_ / "data" / "surveys";
  service.past_cache_bytes = setup.building.keyframe_bytes;
  service.scratch_directory = directory_;
  service.plausibility = script_.plausibility;
  service_ = std::make_unique<AtlasService>(
      *store_, [] { return kNow_ms; }, [](LogLevel, const std::string&) {}, service);
}

void AtlasPlayer::Close() {
  service_.reset();
  store_.reset();
}

void AtlasPlayer::PlayStep(const Step& step) {
  switch (step.kind) {
    case StepKind::kUpload:
      for (const Placing& placing : step.placings) {
        Upload(placing);
      }
      return;
    case StepKind::kUploadTwice:
      return UploadTwice(step.placings);
    case StepKind::kMovePoses:
      return MovePoses(step.placings);
    case StepKind::kChangeSession:
      return ChangeSession(step);
    case StepKind::kCompact:
      return Compact(step);
    case StepKind::kAwaitAnswers:
      return AwaitAnswers();
    case StepKind::kCompare:
      return Compare();
    case StepKind::kNote:
      return TakeNote();
    case StepKind::kReopen:
      Open(step.setup);
      ++counts_.reopened;
      return AwaitAnswers();
  }
}

UploadRequest AtlasPlayer::RequestOf(const Placing& placing) const {
  const ScriptFrame& frame = script_.frames[placing.frame];
  const FrameContent& content = frame.contents[placing.content];
  UploadRequest request;
  request.key = frame.key;
  request.time_ms = content.time_ms;
  request.pose = placing.pose;
  request.blob = content.blob;
  request.is_staged = frame.is_staged;
  return request;
}

void AtlasPlayer::Upload(const Placing& placing) {
  auto answer = Begin<PutKeyframeResult>(
      [&](auto done) { service_->Upload(RequestOf(placing), std::move(done)); });
  unanswered_.emplace_back(
      [this, answer = answer.share(), expected = model_.Put(placing), frame = placing.frame] {
        CheckAnswer(StrCat("upload of frame ", frame).c_str(), answer.get(), expected);
      });
}

// Of each keyframe one upload is the first, whichever thread's it is.
void AtlasPlayer::UploadTwice(const std::vector<Placing>& placings) {
  using Answers = std::vector<std::future<Result<PutKeyframeResult>>>;
  const auto send = [this](const Placing& placing) {
    return Begin<PutKeyframeResult>(
        [&](auto done) { service_->Upload(RequestOf(placing), std::move(done)); });
  };
  Answers first;
  Answers second;
  {
    const std::jthread other([&] {
      std::transform(placings.rbegin(), placings.rend(), std::back_inserter(second), send);
    });
    std::transform(placings.begin(), placings.end(), std::back_inserter(first), send);
  }
  for (std::size_t i = 0; i < placings.size(); ++i) {
    auto a = first[i].get();
    auto b = second[placings.size() - 1 - i].get();
    if (a && a->is_duplicate) {
      std::swap(a, b);
    }
    const std::string what = StrCat("upload of frame ", placings[i].frame);
    CheckAnswer(what.c_str(), WithoutOrder(a), WithoutOrder(model_.Put(placings[i])));
    CheckAnswer(what.c_str(), b, model_.Put(placings[i]));
  }
  model_.TouchSessionsOf(placings);
}

void AtlasPlayer::MovePoses(const std::vector<Placing>& placings) {
  AwaitAnswers();  // a pose is for a keyframe that was acknowledged
  PoseBatchRequest request{{}, "tester", 0};
  for (const Placing& placing : placings) {
    request.updates.push_back({script_.frames[placing.frame].key, placing.pose});
  }
  auto answer = Begin<PoseBatchResult>(
      [&](auto done) { service_->UpdatePoses(std::move(request), std::move(done)); });
  unanswered_.emplace_back([this, answer = answer.share(), expected = model_.Move(placings)] {
    CheckAnswer("pose batch", answer.get(), expected);
  });
}

void AtlasPlayer::ChangeSession(const Step& step) {
  auto answer = Begin<SessionChangeResult>([&](auto done) {
    service_->ChangeSession({step.session, step.action, "tester", ""}, std::move(done));
  });
  unanswered_.emplace_back([this, answer = answer.share(), name = StrCat("session ", step.session),
                            expected = model_.Change(step.session, step.action)] {
    CheckAnswer(name.c_str(), answer.get(), expected);
    if (answer.get() && answer.get()->is_changed && expected->state == SessionState::kPurged) {
      horizon_ = answer.get()->revision;
    }
  });
}

// Which keyframes go is the atlas' choice: that nothing else changes is compared later.
void AtlasPlayer::Compact(const Step& step) {
  AwaitAnswers();
  const auto done = service_->Compact({step.before_ms, "tester"}, Long());
  if (script_.profile.preset != FusionPreset::kBounded) {
    ++counts_.refused;
    Fail(done || done.error().code() != StatusCode::kInvalidArgument,
         [] { return "compaction in another preset was not refused"; });
    return;
  }
  if (Fail(!done, [&] { return "compaction: " + done.error().message(); })) {
    return;
  }
  ++counts_.compacted;
  counts_.dropped += done->stored.dropped;
  horizon_ = done->stored.horizon;
  std::set<KeyframeKey> remaining;
  const auto ids = store_->ListKeyframeIds(0, kManyKeyframes).value();
  for (const std::int64_t id : ids) {
    remaining.insert(store_->ReadKeyframe(id)->record.key);
  }
  const std::string wrong = model_.Keep(remaining, step.before_ms);
  Fail(!wrong.empty(), [&] { return "compaction: " + wrong; });
}

void AtlasPlayer::AwaitAnswers() {
  for (const auto& check : std::exchange(unanswered_, {})) {
    check();
  }
}

void AtlasPlayer::Compare() {
  AwaitAnswers();
  const auto digest = service_->Digest(Long());
  if (Fail(!digest, [&] { return "digest: " + digest.error().message(); })) {
    return;
  }
  ++counts_.compared;
  counts_.tiles += digest->tiles;
  const ModelAtlas::Payloads expected = model_.Tiles();
  if (digest->sha256 != DigestOf(expected)) {
    CompareTiles(expected);
    Fail(true, [] { return "the digest is another one, though every tile is right"; });
  }
  CheckLocality();
}

// The first tile, in key order, that is not what it should be.
void AtlasPlayer::CompareTiles(const ModelAtlas::Payloads& expected) {
  ModelAtlas::Payloads stored;
  const auto listed = store_->ListTiles(-1, kManyTiles);
  if (Fail(!listed, [&] { return listed.error().message(); })) {
    return;
  }
  for (const TileSummary& tile : *listed) {
    const auto read = store_->ReadTile(tile.id);
    if (read && *read) {
      stored[tile.id.Key()] = TilePayloadFromBlob((*read)->blob).value_or(Bytes());
    }
  }
  const auto [ours, right] =
      std::mismatch(stored.begin(), stored.end(), expected.begin(), expected.end());
  Fail(ours != stored.end() || right != expected.end(), [&, ours = ours, right = right] {
    const bool is_extra =
        right == expected.end() || (ours != stored.end() && ours->first < right->first);
    if (is_extra) {
      return NameOf(ours->first) + " is there, expected none";
    }
    const bool is_missing = ours == stored.end() || right->first < ours->first;
    return NameOf(right->first) +
           (is_missing ? " is missing"
                       : StrCat(" differs: ", ours->second.size(), " bytes, expected ",
                                right->second.size(), " of other content"));
  });
}

// A tile's revision moves where its content does, and only where a change could reach it.
void AtlasPlayer::CheckLocality() {
  const auto listed = store_->ListTiles(-1, kManyTiles);
  if (Fail(!listed, [&] { return listed.error().message(); })) {
    return;
  }
  std::map<std::uint64_t, TileState> tiles;
  for (const TileSummary& tile : *listed) {
    tiles[tile.id.Key()] = {tile.revision, tile.payload_hash};
  }
  const std::set<std::uint64_t> touched = model_.TakeTouched();
  for (const auto& [key, tile] : tiles) {
    const auto before = tiles_.find(key);
    const bool is_same = before != tiles_.end() && before->second.revision == tile.revision;
    Fail(is_same && before->second.payload_hash != tile.payload_hash,
         [key = key] { return NameOf(key) + " changed without a new revision"; });
    Fail(!is_same && !touched.contains(key),
         [key = key] { return NameOf(key) + " has a new revision, but no change could reach it"; });
  }
  tiles_ = std::move(tiles);
}

void AtlasPlayer::TakeNote() {
  AwaitAnswers();
  notes_.push_back({service_->revision(), DigestOf(model_.Tiles())});
}

void AtlasPlayer::CompareNotes() {
  for (const Note& note : notes_) {
    const auto digest = service_->DigestAt(note.revision, Long());
    if (note.revision < horizon_) {
      Fail(digest || digest.error().code() != StatusCode::kNotFound,
           [&] { return StrCat("revision ", note.revision, " can still be read"); });
      continue;
    }
    if (Fail(!digest, [&] { return "past digest: " + digest.error().message(); })) {
      return;
    }
    ++counts_.compared_past;
    Fail(digest->sha256 != note.sha256, [&] {
      return StrCat("the digest at revision ", note.revision, " is not the one noted then");
    });
  }
}

void AtlasPlayer::Verify() {
  const auto report = service_->Verify({.rebuild = true}, Long());
  if (Fail(!report, [&] { return "verify: " + report.error().message(); })) {
    return;
  }
  Fail(report->damaged != 0 || report->mismatched != 0,
       [&] { return "verify: " + (report->findings.empty() ? "" : report->findings.front()); });
}

}  // namespace atlas::testing
