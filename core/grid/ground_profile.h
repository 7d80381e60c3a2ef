// The ground along each ray of a virtual scan, and the nearest obstacle that ends it (paper III-B).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/vehicle_body.h"
#include "core/scan/leveled_scan.h"
#include "core/scan/ray_table.h"

namespace atlas {

// The ground that the vehicle stands on: a plane at a right angle to the vehicle's up. Spinning
// sensors do not see the ground next to the vehicle (a VLP-16 from 6.7 m on), but its wheels do.
struct VehicleContact {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  // levelled frame, unit length
  float sensor_height_m = 1.73F;                      // vertically: what the levelled ground shows
  Eigen::Vector2f ahead = Eigen::Vector2f::UnitX();   // unit length, where the vehicle points

  VehiclePlace Place() const { return {.ahead = ahead, .normal = normal}; }

  // Height of the plane at (x, y), levelled frame.
  float HeightAt(float x_m, float y_m) const { return Place().GroundAt(x_m, y_m, sensor_height_m); }
};

struct ProfileOptions {
  float contact_radius_m = 1.5F;     // how far around the sensor the vehicle's plane is the ground
  VehicleBody body;                  // what it stands on was driven on
  float vehicle_clearance_m = 2.5F;  // higher above the ground a vehicle passes below
  // A ground return must be reachable from the one before it at this slope plus this step, and
  // where it lies a step above all ground before it, the slope must show before the gap or behind
  // it: the top of a car that was taken for ground is level, and so is the street before it.
  float max_ground_slope = 0.42F;  // tan 0.4 rad: what segmentation calls ground
  float max_ground_step_m = 0.25F;
  // Between two ground returns the ground is known (GroundSample::is_joined) when the second one is
  // this near to the line that the ground followed until the first, and no ray passed this far
  // below the chord. A step within the gap is off the chord by no more than that.
  float max_chord_error_m = 0.25F;
};

// Whether a return lies so much above the ground below it that no vehicle gets up there, and not so
// high that one passes below: an obstacle, or the flat top of one that was taken for ground.
inline bool Stands(float height_m, const ProfileOptions& options) {
  return height_m > options.max_ground_step_m && height_m <= options.vehicle_clearance_m;
}

struct GroundSample {
  float range_m = 0.0F;
  float z_m = 0.0F;
  // Whether the ground runs straight from the sample before to this one, as far as can be seen. A
  // ray may also pass over a hole: from the edge of a deck to the ramp below it.
  bool is_joined = true;
};

// Where the virtual scan ends: at the nearest obstacle that a vehicle would hit; before that, where
// the ray climbs something that was taken for ground and cannot be reached (a parapet's top); else
// at the farthest ground.
struct RayEnd {
  float range_m = 0.0F;
  bool is_obstacle = false;
};

// One ray: ground samples by growing range, the first two below the vehicle itself.
struct RayProfile {
  std::span<const GroundSample> ground;
  RayEnd end;
  float farthest_m = 0.0F;  // farthest return of any kind

  // Height of the ground below a point at `range_m`: between its samples, else that of the last.
  float GroundAt(float range_m) const;
};

class GroundProfiles {
 public:
  GroundProfiles(const LeveledScan& scan,
                 const RayTable& rays,
                 const VehicleContact& contact,
                 const ProfileOptions& options);

  RayProfile Ray(int ray) const;

 private:
  struct Return {
    float range_m;
    float z_m;
    bool is_ground;
  };

  void Sort(const LeveledScan& scan, const RayTable& rays);
  // Ends the ray that begins with the two `contact` samples.
  void BuildRay(std::span<Return> returns, const ProfileOptions& options);
  // Whether `r`, higher than all ground before it, is on the slope that the ground had before the
  // gap, or on that behind it. `rising`: the returns from the first such ground on.
  static bool IsOnSlope(const Return& r,
                        std::span<const Return> rising,
                        std::span<const GroundSample> ground,
                        const ProfileOptions& options);
  // Slope from the first return of `from` to the next ground at least `base_m` behind it; 0 where
  // there is none, no vehicle climbs it, or other ground or a ray below it lies between the two.
  static float SlopeFrom(std::span<const Return> from, float base_m, const ProfileOptions& options);
  static RayEnd FindEnd(std::span<const Return> returns,
                        const RayProfile& profile,
                        const ProfileOptions& options);
  // Judges every chord of `ground`, a whole ray's.
  static void Join(std::span<const Return> returns,
                   std::span<GroundSample> ground,
                   const ProfileOptions& options);

  std::vector<Return> returns_;  // by ray
  std::vector<std::uint32_t> return_begin_;
  std::vector<GroundSample> ground_;  // by ray
  std::vector<std::uint32_t> ground_begin_;
  std::vector<RayEnd> ends_;
  std::vector<float> farthest_m_;
};

}  // namespace atlas
