// What happens to an atlas in one case of the property test: plain values, drawn from a seed
// (random_atlas.h), played against the product (atlas_player.h) and printed when that fails.
// Nothing in a step depends on the steps before it, so that any of them may be left out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <vector>

#include "core/base/bytes.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/keyframe/keyframe.h"
#include "server/service/fusion/tile_refresher.h"
#include "server/store/session_types.h"

namespace atlas::testing {

// One meaning of a key: what a vehicle sends under it.
struct FrameContent {
  std::int64_t time_ms = 0;
  std::shared_ptr<const Keyframe> keyframe;
  Bytes blob;
};

struct ScriptFrame {
  KeyframeKey key;
  bool is_staged = false;                // as all of its session
  std::array<FrameContent, 3> contents;  // the right one, another scan, the same at another time
};

// How the daemon is set up from one opening to the next: none of it may show in a tile.
struct DaemonSetup {
  unsigned workers = 1;
  std::uint32_t tiles_per_claim = 4;
  TileRefresherOptions building;
  std::size_t max_group = 64;
  std::size_t max_readers = 16;
};

enum class StepKind {
  kUpload,         // each placing of the step, without waiting for the answer
  kUploadTwice,    // all of them from two threads at once, the second in reverse order
  kMovePoses,      // one batch
  kChangeSession,  // retract, restore, release, publish or purge
  kCompact,        // what was taken before `before_ms`
  kAwaitAnswers,   // to all that was sent
  kCompare,        // when clean: with the oracle
  kNote,           // the revision, and what the atlas was then: read again at the end
  kReopen,         // store and daemon, with another setup, whatever is under way
};

struct Placing {
  std::size_t frame = 0;
  QuantizedPose pose;
  std::size_t content = 0;
};

struct Step {
  StepKind kind = StepKind::kCompare;
  std::vector<Placing> placings;
  SessionKey session;
  SessionAction action = SessionAction::kRetract;
  std::int64_t before_ms = 0;
  DaemonSetup setup;
};

struct AtlasScript {
  MapProfile profile;
  std::vector<ScriptFrame> frames;
  PlausibilityLimits plausibility = {0.0, 0.0, 0.0, 0.0};  // none
  DaemonSetup setup;                                       // of the first opening
  std::vector<Step> steps;
  bool is_verified = false;  // at the end, against a rebuild from nothing
};

std::ostream& operator<<(std::ostream& out, const DaemonSetup& setup);
std::ostream& operator<<(std::ostream& out, const Step& step);
// One line for the profile, one a frame, one a step.
std::ostream& operator<<(std::ostream& out, const AtlasScript& script);

}  // namespace atlas::testing
