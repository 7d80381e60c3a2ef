#include "tests/client/ledger/ledger_judge.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "client/vehicle/spooled_keyframe.h"
#include "client/vehicle/stored_file.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/geometry/plausibility.h"

namespace atlas::testing {

void Verdict::Add(const Verdict& other) {
  lost += other.lost;
  twice += other.twice;
  foreign += other.foreign;
  altered += other.altered;
  misplaced += other.misplaced;
  torn += other.torn;
  misjudged += other.misjudged;
  left += other.left;
  if (first.empty()) first = other.first;
}

LedgerJudge::LedgerJudge(const StoredAtlas& atlas) : atlas_(atlas) {
  verdict_.twice = atlas.twice;
}

void LedgerJudge::Note(std::uint64_t& fault, const std::string& what) {
  ++fault;
  if (verdict_.first.empty()) verdict_.first = what;
}

void LedgerJudge::Judge(int vehicle, const LedgerState& ledger, const Spooled& spooled) {
  JudgeFrames(vehicle, ledger, spooled);
  JudgePoses(vehicle, ledger);
  JudgeSessions(vehicle, ledger);
}

void LedgerJudge::JudgeFrames(int vehicle, const LedgerState& ledger, const Spooled& spooled) {
  for (const auto& [id, frame] : ledger.frames) {
    const KeyframeKey key = FleetKey(vehicle, id);
    known_.insert(key);
    const auto stored = atlas_.frames.find(key);
    const bool is_purged = IsPurged(key.session);
    if (stored != atlas_.frames.end()) {
      if (is_purged) Note(verdict_.left, StrCat(key, " is there, and its session was purged"));
      const bool is_as_sent = stored->second.time_ms == FleetTime(id) &&
                              stored->second.blob_hash == Hash64(FleetBlob(key));
      if (!is_as_sent) Note(verdict_.altered, StrCat(key, " is not what was sent"));
    } else if (is_purged) {
      continue;  // whether somebody asked for it is a matter of the session
    } else if (frame.is_acknowledged) {
      Note(verdict_.lost, StrCat(key, " was acknowledged and is not there"));
    } else if (frame.is_taken && !spooled.contains(key)) {
      Note(verdict_.lost, StrCat(key, " was taken by the spool and is nowhere"));
    }
  }
}

// The version that a keyframe stands at is that of its last acknowledged batch, or of one after it
// that was not answered; and a batch that happened at all happened to all of its keyframes.
void LedgerJudge::JudgePoses(int vehicle, const LedgerState& ledger) {
  std::map<FrameId, std::vector<std::uint32_t>> versions;
  std::map<FrameId, std::uint32_t> at_least;
  for (const auto& [version, batch] : ledger.batches) {
    for (const FrameId& id : batch.frames) {
      versions[id].push_back(version);
      if (batch.is_acknowledged) at_least[id] = version;
    }
  }
  std::map<FrameId, std::uint32_t> stands;
  for (const auto& [id, frame] : ledger.frames) {
    const auto stored = atlas_.frames.find(FleetKey(vehicle, id));
    if (stored == atlas_.frames.end()) continue;
    std::vector<std::uint32_t>& possible = versions[id];
    possible.insert(possible.begin(), 0);
    const auto is_at = [&, &frame_id = id](std::uint32_t version) {
      return FleetPose(vehicle, frame_id, version) == stored->second.pose;
    };
    const auto found = std::find_if(possible.rbegin(), possible.rend(), is_at);
    if (found == possible.rend() || *found < at_least[id]) {
      Note(verdict_.misplaced, StrCat(stored->first, " is not at version ", at_least[id]));
    } else {
      stands[id] = *found;
    }
  }
  for (const auto& [version, batch] : ledger.batches) {
    bool has_happened = false;
    bool is_missing = false;
    for (const FrameId& id : batch.frames) {
      const auto stand = stands.find(id);
      if (stand == stands.end()) continue;  // purged, lost or misplaced
      has_happened |= stand->second == version;
      is_missing |= stand->second < version;
    }
    if (has_happened && is_missing) {
      Note(verdict_.torn, StrCat("car", vehicle, ": batch ", version, " happened in part"));
    }
  }
}

void LedgerJudge::JudgeSessions(int vehicle, const LedgerState& ledger) {
  for (const auto& [number, session] : ledger.sessions) {
    const SessionKey key = FleetSession(vehicle, number);
    const auto stored = atlas_.states.find(key);
    if (stored == atlas_.states.end()) {  // nothing of it is there
      if (session.done == SessionAction::kPurge) Note(verdict_.misjudged, StrCat(key, " is new"));
      continue;
    }
    const bool is_as_done = stored->second == StateAfter(vehicle, number, session.done);
    const bool is_as_asked =
        session.asked && stored->second == StateAfter(vehicle, number, session.asked);
    if (!is_as_done && !is_as_asked) {
      Note(verdict_.misjudged, StrCat(key, " is in state ", static_cast<int>(stored->second)));
    }
  }
}

SessionState LedgerJudge::StateAfter(int vehicle,
                                     std::uint32_t session,
                                     std::optional<SessionAction> action) const {
  switch (action.value_or(SessionAction::kRestore)) {
    case SessionAction::kRetract:
      return SessionState::kRetracted;
    case SessionAction::kRestore:
    case SessionAction::kPublish:
      return IsImplausible(vehicle, session) ? SessionState::kQuarantined : SessionState::kLive;
    case SessionAction::kRelease:
      return SessionState::kReleased;
    case SessionAction::kPurge:
      break;
  }
  return SessionState::kPurged;
}

// By what of it is there, as it was uploaded.
bool LedgerJudge::IsImplausible(int vehicle, std::uint32_t session) const {
  UploadedTrack track({});
  for (FrameId id{session, 0}; id.sequence < kFramesOfASession; ++id.sequence) {
    if (!atlas_.frames.contains(FleetKey(vehicle, id))) continue;
    const QuantizedPose pose = FleetPose(vehicle, id, 0);
    if (track.Add({id.sequence, FleetTime(id), pose.x_um, pose.y_um, pose.z_um})) return true;
  }
  return false;
}

bool LedgerJudge::IsPurged(const SessionKey& key) const {
  const auto stored = atlas_.states.find(key);
  return stored != atlas_.states.end() && stored->second == SessionState::kPurged;
}

void LedgerJudge::JudgeAgainst(const StoredAtlas& earlier) {
  for (const auto& [key, frame] : earlier.frames) {
    const bool may_be_gone = IsPurged(key.session);
    if (!may_be_gone && !atlas_.frames.contains(key)) {
      Note(verdict_.lost, StrCat(key, " was there and is gone"));
    }
  }
}

Verdict LedgerJudge::Finish() {
  for (const auto& [key, frame] : atlas_.frames) {
    if (!known_.contains(key)) Note(verdict_.foreign, StrCat(key, " was never sent"));
  }
  return verdict_;
}

LedgerJudge::Spooled ReadSpool(const std::filesystem::path& folder) {
  LedgerJudge::Spooled keys;
  if (!std::filesystem::exists(folder)) return keys;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".keyframe") continue;
    const auto file = LoadFile(entry.path(), kMaxSpooledBytes);
    const auto keyframe = file ? DecodeSpooled(*file) : Error(file.error());
    if (!keyframe) throw std::runtime_error(keyframe.error().message());
    if (entry.path().parent_path() != folder) {
      throw std::runtime_error(StrCat("the spool was refused ", keyframe->key));
    }
    keys.insert(keyframe->key);
  }
  return keys;
}

}  // namespace atlas::testing
