#include "tests/bench/memory/drive_copies.h"

#include <algorithm>
#include <map>
#include <utility>

#include "client/connection/keyframe_uploader.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/scan/drive_folder.h"
#include "tests/bench/updates/recorded_keyframes.h"

namespace atlas::testing {
namespace {

// Farther apart than a drive is long and keyframes reach, and no multiple of a tile: the same
// surfaces are cut into other cells each time.
constexpr double kColumn_m = 97.37;
constexpr double kRow_m = 61.53;

// The first n^2 numbers are a square, whatever n: an atlas of more copies is larger, and not
// another around a place of it.
Eigen::Vector2d ShiftOf(std::uint32_t number) {
  std::uint32_t n = 0;
  while ((n + 1) * (n + 1) <= number) {
    ++n;
  }
  const std::uint32_t on_edge = number - n * n;
  const std::uint32_t column = std::min(n, on_edge);
  const std::uint32_t row = std::min(n, 2 * n - on_edge);
  return {kColumn_m * column, kRow_m * row};
}

}  // namespace

Result<DriveCopies> DriveCopies::Read(const std::filesystem::path& folder,
                                      const MapProfile& profile,
                                      std::size_t nth) {
  const auto drive = OpenDriveFolder(folder);
  if (!drive) return Error(drive.error());
  std::map<std::uint32_t, Pose> poses;
  for (const DriveScan& scan : drive->scans) {
    poses[scan.number] = scan.T_world_sensor;
  }
  const auto placed = ReadKeyframes(folder, profile);
  if (!placed) return Error(placed.error());
  DriveCopies copies;
  for (std::size_t i = 0; i < placed->size(); i += nth) {
    const PlacedKeyframe& keyframe = (*placed)[i];
    const std::uint32_t sequence = keyframe.key.sequence;
    copies.keyframes_.push_back({sequence, poses.at(sequence), EncodeKeyframe(*keyframe.keyframe)});
    copies.middle_m_ += poses.at(sequence).translation().head<2>();
  }
  copies.middle_m_ /= static_cast<double>(copies.keyframes_.size());
  return copies;
}

Status DriveCopies::Upload(AtlasClient& client, std::uint32_t number) const {
  const Eigen::Vector2d shift_m = ShiftOf(number);
  KeyframeUploader uploader(client);
  for (const Recorded& recorded : keyframes_) {
    Pose T_world_sensor = recorded.T_world_sensor;
    T_world_sensor.translation().head<2>() += shift_m;
    KeyframeUpload upload;
    upload.key = {{StrCat("car.", number), "copy"}, recorded.sequence};
    upload.time_ms = std::int64_t{100} * recorded.sequence;
    upload.T_world_sensor = QuantizedPose::FromPose(T_world_sensor);
    upload.blob = recorded.blob;
    ATLAS_RETURN_IF_ERROR(uploader.Upload(upload));
  }
  return uploader.Finish();
}

Eigen::Vector2d DriveCopies::MiddleOf(std::uint32_t number) const {
  return middle_m_ + ShiftOf(number);
}

}  // namespace atlas::testing
