#include "client/vehicle/spooled_keyframe.h"

#include <string>

#include "client/vehicle/stored_file.h"

namespace atlas {
namespace {

// Frozen.
constexpr std::uint32_t kMagic = 0x4B564152;  // "RAVK"
constexpr std::uint8_t kVersion = 1;
constexpr std::uint8_t kStagedVersion = 2;  // the same, of a staged session
constexpr std::uint8_t kPriorVersion = 3;   // as 1, with a prior
constexpr std::uint8_t kStagedPriorVersion = 4;

std::uint8_t VersionOf(const KeyframeUpload& upload) {
  if (upload.prior) return upload.is_staged ? kStagedPriorVersion : kPriorVersion;
  return upload.is_staged ? kStagedVersion : kVersion;
}

void WritePrior(const KnownPosition& prior, ByteWriter& out) {
  for (const std::int64_t coordinate : {prior.x_um, prior.y_um, prior.z_um}) {
    out.I64(coordinate);
  }
  out.U32(prior.radius_mm);
}

KnownPosition ReadPrior(ByteReader& in) {
  KnownPosition prior;
  for (std::int64_t* coordinate : {&prior.x_um, &prior.y_um, &prior.z_um}) {
    *coordinate = in.I64();
  }
  prior.radius_mm = in.U32();
  return prior;
}

}  // namespace

Bytes EncodeSpooled(const KeyframeUpload& upload) {
  ByteWriter out;
  out.U32(kMagic);
  out.U8(VersionOf(upload));
  out.String(upload.key.session.vehicle);
  out.String(upload.key.session.session);
  out.U32(upload.key.sequence);
  out.I64(upload.time_ms);
  const QuantizedPose& pose = upload.T_world_sensor;
  for (const std::int64_t coordinate : {pose.x_um, pose.y_um, pose.z_um}) {
    out.I64(coordinate);
  }
  for (const std::int32_t part : pose.quaternion) {
    out.I32(part);
  }
  if (upload.prior) WritePrior(*upload.prior, out);
  out.U32(static_cast<std::uint32_t>(upload.blob.size()));
  out.Raw(upload.blob);
  return WithChecksum(out.Take());
}

Result<SpooledKeyframe> DecodeSpooled(ByteSpan file) {
  const Result<ByteSpan> content = WithoutChecksum(file);
  if (!content) return Error(content.error());
  ByteReader in(*content);
  const bool is_of_kind = in.U32() == kMagic;
  const std::uint8_t version = in.U8();
  const bool is_ours = is_of_kind && version >= kVersion && version <= kStagedPriorVersion;
  SpooledKeyframe keyframe;
  keyframe.is_staged = version == kStagedVersion || version == kStagedPriorVersion;
  keyframe.key.session.vehicle = std::string(in.String(kMaxNameSize));
  keyframe.key.session.session = std::string(in.String(kMaxNameSize));
  keyframe.key.sequence = in.U32();
  keyframe.time_ms = in.I64();
  QuantizedPose& pose = keyframe.T_world_sensor;
  for (std::int64_t* coordinate : {&pose.x_um, &pose.y_um, &pose.z_um}) {
    *coordinate = in.I64();
  }
  for (std::int32_t& part : pose.quaternion) {
    part = in.I32();
  }
  if (version >= kPriorVersion) keyframe.prior = ReadPrior(in);
  const ByteSpan blob = in.Raw(in.U32());
  keyframe.blob.assign(blob.begin(), blob.end());
  if (!is_ours || !in.ok() || in.remaining() != 0 || !keyframe.key.Validate().ok()) {
    return Error(StatusCode::kInvalidData, "spooled keyframe: the file holds something else");
  }
  return keyframe;
}

}  // namespace atlas
