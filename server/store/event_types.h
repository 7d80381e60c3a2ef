// What happened to an atlas beside uploads: who did what, kept for good.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace atlas {

// Frozen numbers (docs/formats/store.md).
enum class EventKind : std::uint8_t {
  kPoses = 1,            // a batch of corrections
  kRetract = 2,          // of a session
  kRestore = 3,          // of a session
  kCompact = 4,          // keyframes that mattered nowhere went
  kRules = 5,            // of fusion: every tile is fused again
  kMarksRestored = 6,    // marks were damaged or lost: every tile is fused again
  kKeyframeDamaged = 7,  // it is out of the map
  kKeyframeHealed = 8,   // the vehicle sent it again
  kKeyframeGivenUp = 9,  // by who asked for repairs
  kSessionQuarantined = 10,
  kSessionReleased = 11,
  kSessionPurged = 12,
  kBackupRestored = 13,
  kUpgraded = 14,  // from an earlier version of the schema
  kCountersRestored = 15,
  kTablesRepaired = 16,  // by who asked for repairs
  kBackup = 17,          // of the atlas as it was
  kLogDamaged = 18,      // what was committed last is lost
  kSessionPublished = 19,
  kPosesUndone = 20,    // a batch of corrections was taken back, by another one
  kSessionStaged = 21,  // again: what published it was undone
};

// The author of what nobody asked for.
inline constexpr const char* kAtlasItself = "atlasd";

// As logs and the protocol name it.
constexpr std::string_view EventName(EventKind kind) {
  switch (kind) {
    case EventKind::kPoses:
      return "poses";
    case EventKind::kRetract:
      return "retract";
    case EventKind::kRestore:
      return "restore";
    case EventKind::kCompact:
      return "compact";
    case EventKind::kRules:
      return "rules";
    case EventKind::kMarksRestored:
      return "marks_restored";
    case EventKind::kKeyframeDamaged:
      return "keyframe_damaged";
    case EventKind::kKeyframeHealed:
      return "keyframe_healed";
    case EventKind::kKeyframeGivenUp:
      return "keyframe_given_up";
    case EventKind::kSessionQuarantined:
      return "session_quarantined";
    case EventKind::kSessionReleased:
      return "session_released";
    case EventKind::kSessionPurged:
      return "session_purged";
    case EventKind::kBackupRestored:
      return "backup_restored";
    case EventKind::kUpgraded:
      return "upgraded";
    case EventKind::kCountersRestored:
      return "counters_restored";
    case EventKind::kTablesRepaired:
      return "tables_repaired";
    case EventKind::kBackup:
      return "backup";
    case EventKind::kLogDamaged:
      return "log_damaged";
    case EventKind::kSessionPublished:
      return "session_published";
    case EventKind::kPosesUndone:
      return "poses_undone";
    case EventKind::kSessionStaged:
      return "session_staged";
  }
  return "unknown";  // of a later version
}

struct Event {
  std::uint64_t id = 0;        // 1, 2, 3, ...
  std::uint64_t revision = 0;  // of the atlas after it
  std::int64_t time_ms = 0;    // Unix time
  EventKind kind = EventKind::kPoses;
  std::string author;   // name of a certificate or token, or what the client calls itself
  std::string subject;  // a session, say; may be empty
  std::string detail;   // for people
  // Its row is: `detail` says how, and nothing else is told.
  bool is_damaged = false;
};

}  // namespace atlas
