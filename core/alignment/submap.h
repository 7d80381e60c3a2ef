// A few keyframes of one session in a row, fused to a small map of their own: what a session looks
// like around a place, whatever becomes of its poses. Its frame stands upright at the place of the
// middle keyframe's sensor and is turned against it, each by another angle, so that the lattices
// of two submaps do not lie on each other (decision 0601).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/keyframe/keyframe.h"
#include "core/localization/places/range_profile.h"
#include "core/localization/registration/scan_features.h"
#include "core/tile/tile.h"

namespace atlas {

struct SubmapOptions {
  std::uint8_t occupied_nibble = 10;  // p >= 0.61
  // A ground that was interpolated is known so much less well, one standard deviation, than one
  // that was measured. Interpolated across a kerb it rises where the road is level, and from each
  // place elsewhere: in an atlas all places are together, of two submaps each has its own.
  std::uint16_t interpolated_mm = 5'000;
  double place_spacing_m = 2.0;  // between the places that are described
  double block_m = 0.4;          // of the blocks that they are described by
  FeatureOptions features;
};

struct SubmapMember {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  Pose T_world_sensor = Pose::Identity();
  std::shared_ptr<const Keyframe> keyframe;
};

// Where the vehicle was, and what it looks like from there.
struct SubmapPlace {
  Eigen::Vector3d ground = Eigen::Vector3d::Zero();  // below the sensor, submap frame, metres
  RangeProfile profile;
};

// T_world_submap: upright at the sensor of the middle one of the members, which are not none, of
// two the later one; turned from its heading by GridYaw(number).
Pose SubmapFrame(std::span<const Pose> T_world_sensor, std::uint64_t number);
Pose SubmapFrame(std::span<const SubmapMember> members, std::uint64_t number);

// Its tiles are kept encoded: decoded, those of a submap are megabytes.
class Submap {
 public:
  using Tiles = std::vector<std::shared_ptr<const Tile>>;

  // `members`, not empty, rising in sequence, made for `profile`; `number` names the turn of its
  // frame. kInvalidData, naming the keyframe, when a member's pose is tilted against its grid by
  // more than 2 degrees.
  static Result<Submap> Fuse(std::span<const SubmapMember> members,
                             std::uint64_t number,
                             const MapProfile& profile,
                             const SubmapOptions& options);

  // For a file of this machine's, with a checksum, and back. kInvalidData: they are no submap's.
  Bytes Encode() const;
  static Result<Submap> Decode(ByteSpan bytes);

  // All in the submap's frame. kInvalidData: the profile is another one.
  Result<Tiles> DecodeTiles(const MapProfile& profile) const;
  const ScanFeatures& features() const { return features_; }
  const std::vector<SubmapPlace>& places() const { return places_; }
  // All that was seen lies within, from the frame's origin, in the plane.
  double radius_m() const { return radius_m_; }

 private:
  Submap() = default;

  void DescribePlaces(std::span<const SubmapMember> members,
                      const Pose& T_submap_world,
                      const Tiles& tiles,
                      const MapProfile& profile,
                      const SubmapOptions& options);
  void ExtractFeatures(const Tiles& tiles, const MapProfile& profile, const SubmapOptions& options);

  std::vector<Bytes> blobs_;
  ScanFeatures features_;
  std::vector<SubmapPlace> places_;
  double radius_m_ = 0.0;
};

}  // namespace atlas
