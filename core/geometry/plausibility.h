// Whether a vehicle can have come along the keyframes of its session, by the places and times that
// it uploaded. Pure: the verdict depends on nothing else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

namespace atlas {

// docs/decisions/0505-quarantine-and-purge.md says where the numbers come from. How long the way
// from one keyframe to another may be is the jump, however little time passed, and what the speed
// makes of that.
struct PlausibilityLimits {
  double max_speed_mps = 90.0;  // 0: as far as they like
  double max_jump_m = 50.0;
  double max_climb_mps = 15.0;  // the same up and down; 0: likewise
  double max_height_jump_m = 10.0;

  friend bool operator==(const PlausibilityLimits&, const PlausibilityLimits&) = default;
};

// From keyframe to keyframe by sequence number, a way that is judged has at most so many steps.
inline constexpr std::size_t kMostJudgedSteps = 8;
// A longer step counts as one of this, so that no leap of a clock excuses every distance.
inline constexpr double kLongestStep_s = 3'600.0;

// Where and when a keyframe was taken, as it was uploaded.
struct UploadedPlace {
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;
  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::int64_t z_um = 0;
};

// Two keyframes of a session, by their sequence numbers, and what cannot be between them, in one
// line for people: "keyframe 17 to 18: 812 m in 0.10 s, at most 90 m/s and 50 m".
struct ImplausibleWay {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::string reason;
};

// Keyframes of one session in the order of their sequence numbers. One thread.
class UploadedTrack {
 public:
  explicit UploadedTrack(const PlausibilityLimits& limits) : limits_(limits) {}

  // The shortest way that ends at this one and cannot be: along those that were added, each way has
  // the length of all its steps, and the time from its first to its last.
  std::optional<ImplausibleWay> Add(const UploadedPlace& place);
  // No way leads from what was added to what comes now.
  void Break() { last_.clear(); }

 private:
  PlausibilityLimits limits_;
  std::deque<UploadedPlace> last_;  // kMostJudgedSteps at most
};

}  // namespace atlas
