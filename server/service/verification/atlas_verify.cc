#include "server/service/verification/atlas_verify.h"

#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/tile/tile_codec.h"
#include "server/service/upload_check.h"
#include "server/store/await.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 1'024;
constexpr int kAttempts = 10;  // at a keyframe that is corrected all the time

Status CheckTileBlob(const StoredTile& tile, const MapProfile& profile) {
  const auto payload = TilePayloadFromBlob(tile.blob);
  if (!payload) {
    return payload.error().WithContext(StrCat("tile ", tile.id));
  }
  const auto decoded = DecodeTile(tile.blob, profile);
  if (!decoded) {
    return decoded.error().WithContext(StrCat("tile ", tile.id));
  }
  if (Hash64(*payload) != tile.payload_hash || decoded->id != tile.id) {
    return Status(StatusCode::kInvalidData,
                  StrCat("tile ", tile.id, " holds the content of another tile"));
  }
  return {};
}

}  // namespace

AtlasVerifier::AtlasVerifier(AtlasStore& store, Options options)
    : store_(store),
      options_(std::move(options)),
      looks_for_missing_(options_.request.rebuild),
      keyframes_(options_.keyframe_bytes),
      builder_(store, keyframes_, tiles_, options_.tile_bytes) {}

Result<VerifyReport> AtlasVerifier::Run() {
  if (Status status = RepairTables(TableRepair::kRows); !status.ok()) {
    return Error(std::move(status));
  }
  for (const auto step : {&AtlasVerifier::VerifySessions, &AtlasVerifier::VerifyCompactions,
                          &AtlasVerifier::VerifyCounters, &AtlasVerifier::VerifyKeyframes,
                          &AtlasVerifier::VerifyTiles, &AtlasVerifier::VerifyMissingTiles}) {
    if (Status status = (this->*step)(); !status.ok()) {
      return Error(std::move(status));
    }
  }
  if (Status status = RepairTables(TableRepair::kSums); !status.ok()) {
    return Error(std::move(status));
  }
  if (!unnoted_.empty()) {
    report_.findings.push_back(
        StrCat("what was found could not be noted, and is as it was: ", unnoted_));
  }
  return std::move(report_);
}

Status AtlasVerifier::RepairTables(TableRepair what) {
  if (!options_.request.repair) {
    return {};
  }
  const auto repaired = Await<std::uint32_t>(
      [&](auto done) { store_.RepairTables(what, options_.request.author, std::move(done)); });
  if (!repaired) {
    return repaired.error();
  }
  report_.restored += *repaired;
  return {};
}

// kDamaged: it was corrected meanwhile.
Result<RepairOutcome> AtlasVerifier::RepairOnce(std::int64_t id) {
  KeyframeRepair repair{id, options_.request.author, std::nullopt, true};
  if (const auto stored = store_.ReadKeyframeRecord(id)) {
    repair.pose = stored->pose;
    if (auto placed = CheckPose(*stored, stored->pose, store_.identity().profile)) {
      repair.footprint = std::move(placed->footprint);
    }
  }
  return Await<RepairOutcome>(
      [&](auto done) { store_.RepairKeyframe(std::move(repair), std::move(done)); });
}

Status AtlasVerifier::HandleKeyframe(std::int64_t id, const Status& damage) {
  if (damage.code() != StatusCode::kInvalidData) {
    return damage;
  }
  if (!options_.request.repair) {
    const auto noted =
        Await<std::uint32_t>([&](auto done) { store_.NoteDamage({id}, std::move(done)); });
    return noted ? Status() : Unnoted(noted.error());
  }
  Result<RepairOutcome> outcome = RepairOutcome::kDamaged;
  for (int i = 0; outcome && *outcome == RepairOutcome::kDamaged && i < kAttempts; ++i) {
    outcome = RepairOnce(id);
  }
  if (!outcome) {
    return outcome.error();
  }
  report_.restored += *outcome == RepairOutcome::kRestored ? 1U : 0U;
  report_.given_up += *outcome == RepairOutcome::kGivenUp ? 1U : 0U;
  return {};
}

// A damaged tile is built again from its keyframes.
Status AtlasVerifier::HandleTile(const TileId& id) {
  const auto marked =
      Await<std::uint32_t>([&](auto done) { store_.MarkDirty({id}, std::move(done)); });
  if (!marked) {
    return Unnoted(marked.error());
  }
  ++report_.restored;
  ++report_.marks;
  return {};
}

// What lies under the key of another tile is missing at its own, of which nothing else may tell.
Status AtlasVerifier::HandlePlaceOf(const TileId& id) {
  const auto tile = store_.ReadTile(id);
  if (!tile || !*tile) {
    return {};
  }
  const auto decoded = DecodeTile((*tile)->blob, store_.identity().profile);
  return decoded && decoded->id != id ? HandleTile(decoded->id) : Status();
}

// A disk that takes nothing keeps nobody from being told what is found on it.
Status AtlasVerifier::Unnoted(const Status& refusal) {
  const bool is_of_the_disk = refusal.code() == StatusCode::kResourceExhausted ||
                              refusal.code() == StatusCode::kPermissionDenied ||
                              refusal.code() == StatusCode::kUnavailable;
  if (!is_of_the_disk || options_.request.repair) {
    return refusal;
  }
  unnoted_ = refusal.message();
  return {};
}

// Counts damage; every other failure ends the verification.
Status AtlasVerifier::Note(Status problem) {
  if (problem.ok() || problem.code() != StatusCode::kInvalidData) {
    return problem;
  }
  ++report_.damaged;
  if (report_.findings.size() < options_.max_findings) {
    report_.findings.push_back(problem.message());
  }
  return {};
}

Status AtlasVerifier::Mismatch(const TileId& id, const std::string& what) {
  ++report_.mismatched;
  if (report_.findings.size() < options_.max_findings) {
    report_.findings.push_back(StrCat("tile ", id, " ", what));
  }
  return options_.request.repair ? HandleTile(id) : Status();
}

Status AtlasVerifier::VerifySessions() {
  SessionKey after;
  while (true) {
    const auto sessions = store_.ListSessions(after, kPage);
    if (!sessions) {
      return Note(sessions.error());
    }
    if (sessions->empty()) {
      return {};
    }
    for (const SessionRecord& session : *sessions) {
      ATLAS_RETURN_IF_ERROR(options_.check_stop());
      ATLAS_RETURN_IF_ERROR(Note(store_.CheckSession(session.key)));
    }
    after = sessions->back().key;
  }
}

Status AtlasVerifier::VerifyCompactions() {
  return Note(store_.CheckCompactions());
}

Status AtlasVerifier::VerifyCounters() {
  Status counted = store_.CheckCounters();
  looks_for_missing_ = looks_for_missing_ || !counted.ok();
  return Note(std::move(counted));
}

// Purges and compactions go on meanwhile: what they delete is no damage.
Result<bool> AtlasVerifier::IsListed(std::int64_t id) {
  const auto ids = store_.ListKeyframeIds(id - 1, 1);
  if (!ids) {
    return Error(ids.error());
  }
  return !ids->empty() && ids->front() == id;
}

Status AtlasVerifier::VerifyKeyframes() {
  std::int64_t after = 0;
  while (true) {
    const auto ids = store_.ListKeyframeIds(after, kPage);
    if (!ids) {
      return ids.error();
    }
    if (ids->empty()) {
      return {};
    }
    for (const std::int64_t id : *ids) {
      ATLAS_RETURN_IF_ERROR(options_.check_stop());
      ++report_.checked;
      const Status status = CheckKeyframe(id);
      if (status.ok()) {
        continue;
      }
      const Result<bool> is_listed = IsListed(id);
      if (!is_listed) {
        return is_listed.error();
      }
      if (*is_listed) {
        ATLAS_RETURN_IF_ERROR(Note(status));
        ATLAS_RETURN_IF_ERROR(HandleKeyframe(id, status));
      }
    }
    after = ids->back();
  }
}

Status AtlasVerifier::CheckKeyframe(std::int64_t id) {
  const auto stored = store_.ReadKeyframe(id);
  if (!stored) {
    return stored.error();
  }
  const KeyframeRecord& record = stored->record;
  const std::string name = StrCat("keyframe ", record.key);
  const auto placed = CheckPose(record, record.pose, store_.identity().profile);
  if (!placed) {
    return placed.error();
  }
  if (placed->footprint != stored->footprint) {
    return Status(StatusCode::kInvalidData, name + ": the store lists other tiles than it touches");
  }
  const auto blob = store_.ReadKeyframeBlob(id);
  if (!blob) {
    return blob.error().WithContext(name);
  }
  if (options_.on_read) {
    options_.on_read(blob->size());
  }
  const auto keyframe = DecodeKeyframe(*blob);
  return keyframe ? Status() : keyframe.error().WithContext(name);
}

Status AtlasVerifier::VerifyTiles() {
  std::int64_t after = -1;
  while (true) {
    const auto page = store_.ListTiles(after, kPage);
    if (!page) {
      return Note(page.error());  // they cannot be listed
    }
    if (page->empty()) {
      return {};
    }
    for (const TileSummary& tile : *page) {
      ATLAS_RETURN_IF_ERROR(options_.check_stop());
      ++report_.checked;
      if (const Status status = CheckTile(tile.id); !status.ok()) {
        ATLAS_RETURN_IF_ERROR(Note(status));
        ATLAS_RETURN_IF_ERROR(HandleTile(tile.id));
        ATLAS_RETURN_IF_ERROR(HandlePlaceOf(tile.id));
      }
    }
    after = static_cast<std::int64_t>(page->back().id.Key());
  }
}

Status AtlasVerifier::CheckTile(const TileId& id) {
  const auto tile = store_.ReadTile(id);
  if (!tile) {
    return tile.error();
  }
  if (!*tile) {
    return {};
  }
  if (options_.on_read) {
    options_.on_read((*tile)->blob.size());
  }
  ATLAS_RETURN_IF_ERROR(CheckTileBlob(**tile, store_.identity().profile));
  if (looks_for_missing_) {
    ATLAS_RETURN_IF_ERROR(CheckParentExists(id));
  }
  return options_.request.rebuild ? CompareTile(id, *tile) : Status();
}

// Parents are rebuilt from stored children, which are themselves compared: level by level this is a
// rebuild from the keyframes.
Status AtlasVerifier::CompareTile(const TileId& id, const std::optional<StoredTile>& stored) {
  const auto built = builder_.Build(id, options_.check_stop);
  if (!built) {
    return built.error().WithContext(StrCat("rebuilding tile ", id));
  }
  if (!built->content && !stored) {
    return {};
  }
  if (!built->content || !stored) {
    return Mismatch(id, stored ? "is stored but its keyframes make none" : "is missing");
  }
  const auto expected = TilePayloadFromBlob(built->content->blob);
  const auto actual = TilePayloadFromBlob(stored->blob);
  if (!expected || !actual || *expected != *actual) {
    return Mismatch(id, "is not what its keyframes make");
  }
  return {};
}

Status AtlasVerifier::CheckParentExists(const TileId& id) {
  if (id.level + 1 >= store_.identity().profile.levels) {
    return {};
  }
  const auto parent = store_.ReadTile(id.Parent());
  if (parent && !*parent) {
    return CompareTile(id.Parent(), std::nullopt);
  }
  return {};  // a damaged parent is found when its own turn comes
}

// Level-0 tiles that keyframes touch but that are not stored: nothing may be seen in them.
Status AtlasVerifier::VerifyMissingTiles() {
  std::int64_t after = -1;
  while (looks_for_missing_) {
    const auto page = store_.ListFootprintTiles(0, after, kPage);
    if (!page) {
      return page.error();
    }
    if (page->empty()) {
      break;
    }
    for (const TileId& id : *page) {
      ATLAS_RETURN_IF_ERROR(options_.check_stop());
      const auto tile = store_.ReadTile(id);
      if (tile && !*tile) {
        ATLAS_RETURN_IF_ERROR(Note(CompareTile(id, std::nullopt)));
      }
    }
    after = static_cast<std::int64_t>(page->back().Key());
  }
  return {};
}

}  // namespace atlas
