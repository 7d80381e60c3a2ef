// Participants by time and cars by slot.
#include "core/simulation/traffic.h"

#include <cmath>
#include <utility>

#include "core/base/hash_random.h"
#include "core/simulation/worlds/props.h"

namespace atlas {
namespace {

constexpr double kMaxDelay_m = 8.0;
constexpr std::uint64_t kParkedStream = 0x9A4CED;
// The vehicle with a body's half length and width of another one around it.
constexpr double kTooNearX_m = 5.0;
constexpr double kTooNearY_m = 1.9;
constexpr double kTooNearZ_m = 2.5;

// The box around a mesh, in the mesh's frame.
TruthBox BoxOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    bounds.extend(vertex);
  }
  TruthBox box;
  if (!bounds.isEmpty()) {
    box.T_world_box.translation() = bounds.center().cast<double>();
    box.size_m = bounds.sizes().cast<double>();
    box.label = mesh.labels.front();
  }
  return box;
}

TruthBox Moved(const TruthBox& box, const Eigen::Isometry3d& T_world_thing) {
  TruthBox moved = box;
  moved.T_world_box = T_world_thing * box.T_world_box;
  return moved;
}

TriangleMesh ParkedCar(const ParkedSlot& slot) {
  return CarMesh(TruthLabel(TruthClass::kCar, slot.deck));
}

bool IsWithin(const Eigen::Isometry3d& T_world_thing, const DriveMoment& moment, double radius_m) {
  return (T_world_thing.translation() - moment.T_world_sensor.translation()).norm() < radius_m;
}

bool IsAtVehicle(const DriveMoment& moment, const Eigen::Isometry3d& T_world_participant) {
  const Eigen::Vector3d p =
      (moment.T_world_sensor.inverse() * T_world_participant.translation()).cwiseAbs();
  return p.x() < kTooNearX_m && p.y() < kTooNearY_m && p.z() < kTooNearZ_m;
}

}  // namespace

Traffic::Traffic(std::vector<TrafficParticipant> participants,
                 std::vector<DrivePath> legs,
                 std::vector<DrivePath> oncoming_legs,
                 const std::vector<ParkedSlot>& slots,
                 const TrafficOptions& options)
    : options_(options),
      participants_(std::move(participants)),
      legs_(std::move(legs)),
      oncoming_legs_(std::move(oncoming_legs)) {
  participants_.push_back({CarMesh(TruthLabel(TruthClass::kMovingCar))});
  for (const TrafficParticipant& participant : participants_) {
    participant_boxes_.push_back(BoxOf(participant.mesh));
  }
  for (std::size_t i = 0; options.parked_seed != 0 && i < slots.size(); ++i) {
    if (HashRandom(options.parked_seed, kParkedStream, i).Below(2) == 0) {
      parked_.push_back(slots[i]);
      parked_boxes_.push_back(Moved(BoxOf(ParkedCar(slots[i])), slots[i].T_world_car));
    }
  }
}

std::vector<Traffic::Placed> Traffic::PlacedAt(const DriveMoment& moment) const {
  std::vector<Placed> placed;
  const std::size_t convoy = participants_.size() - 1;
  for (std::size_t i = 0; i < convoy; ++i) {
    const TrafficParticipant& participant = participants_[i];
    if (participant.leg != moment.leg) {
      continue;
    }
    const DrivePath& path = (participant.is_oncoming ? oncoming_legs_ : legs_)[participant.leg];
    const double delay_m =
        options_.seed == 0 ? 0.0 : HashRandom(options_.seed, i).Uniform(0.0, kMaxDelay_m);
    const double driven_m =
        participant.is_leading ? moment.along_m : participant.speed_m_s * moment.leg_time_s;
    const double along_m = participant.start_m + delay_m + driven_m;
    if (along_m < 0.0 || along_m > path.length_m()) {
      continue;
    }
    const Eigen::Isometry3d frame = FrameAt(path.At(along_m, participant.left_m));
    if (!IsAtVehicle(moment, frame)) {
      placed.push_back({i, frame});
    }
  }
  for (const Pose& T_world_car : moment.T_world_convoy) {
    if (!IsAtVehicle(moment, T_world_car)) {
      placed.push_back({convoy, T_world_car});
    }
  }
  return placed;
}

std::vector<TruthBox> Traffic::MovingBoxes(const DriveMoment& moment, double radius_m) const {
  std::vector<TruthBox> boxes;
  for (const Placed& placed : PlacedAt(moment)) {
    if (IsWithin(placed.T_world_participant, moment, radius_m)) {
      boxes.push_back(Moved(participant_boxes_[placed.participant], placed.T_world_participant));
    }
  }
  return boxes;
}

CastableMesh Traffic::MeshAround(const DriveMoment& moment,
                                 double radius_m,
                                 const Eigen::Vector3d& origin) const {
  TriangleMesh mesh;
  const auto append = [&](const TriangleMesh& thing, Eigen::Isometry3d T_part_thing) {
    T_part_thing.translation() -= origin;
    mesh.Append(thing, T_part_thing);
  };
  for (const Placed& placed : PlacedAt(moment)) {
    if (IsWithin(placed.T_world_participant, moment, radius_m)) {
      append(participants_[placed.participant].mesh, placed.T_world_participant);
    }
  }
  for (const ParkedSlot& slot : parked_) {
    if (IsWithin(slot.T_world_car, moment, radius_m)) {
      append(ParkedCar(slot), slot.T_world_car);
    }
  }
  return CastableMesh(std::move(mesh), origin);
}

}  // namespace atlas
