#include "client/merge/plan/submap_builder.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "client/merge/plan/parallel.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/fusion/tile_fusion.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas {
namespace {

std::string NameOf(const MergeSession& session, std::size_t keyframe) {
  return StrCat("keyframe ", KeyframeKey{session.key, session.keyframes[keyframe].sequence});
}

// Equal for equal sessions: what is fused of them is the same on every machine.
std::uint64_t NumberOf(const MergeSession& session, const SubmapCut& cut) {
  const std::string name = StrCat(session.key.vehicle, "/", session.key.session, "/",
                                  session.keyframes[cut.begin].sequence);
  return Hash64(ByteSpan(reinterpret_cast<const std::uint8_t*>(name.data()), name.size())) >> 16;
}

// Of what a submap is fused, and how.
std::uint64_t ContentOf(const MergeSession& session,
                        const SubmapCut& cut,
                        const MergeContext& context) {
  const SubmapOptions& options = context.options.submaps;
  ByteWriter out;
  out.U64(kFusionRules);
  out.U64(context.profile.Hash());
  out.U64(NumberOf(session, cut));
  out.U8(options.occupied_nibble);
  for (const double number :
       {options.place_spacing_m, options.block_m, double{options.features.max_range_m},
        double{options.features.column_voxel_m}, double{options.features.column_height_m},
        double{options.features.ground_voxel_m}}) {
    out.U64(std::bit_cast<std::uint64_t>(number));
  }
  out.U64(options.features.max_returns);
  for (std::size_t i = cut.begin; i < cut.end; ++i) {
    const MergeKeyframe& keyframe = session.keyframes[i];
    out.U32(keyframe.sequence);
    out.I64(keyframe.time_ms);
    out.U64(keyframe.blob_hash);
  }
  return Hash64(out.bytes());
}

// A submap that is to be had: known, or of these blobs.
struct Wanted {
  SubmapCut cut;
  std::uint64_t content = 0;
  Pose T_world_submap = Pose::Identity();
  std::vector<Pose> T_submap_member;
  std::vector<Bytes> blobs;
  std::optional<SubmapSketch> sketch;
};

class Builder {
 public:
  Builder(const MergeSession& session,
          const std::vector<Pose>& T_world_sensor,
          const MergeContext& context,
          const ShapeTolerance& tolerance)
      : session_(session),
        T_world_sensor_(T_world_sensor),
        context_(context),
        tolerance_(tolerance) {}

  Wanted Want(const SubmapCut& cut) const {
    Wanted wanted{cut, ContentOf(session_, cut, context_), {}, {}, {}, {}};
    wanted.T_world_submap =
        SubmapFrame(std::span(T_world_sensor_).subspan(cut.begin, cut.end - cut.begin),
                    NumberOf(session_, cut));
    const Pose T_submap_world = wanted.T_world_submap.inverse();
    for (std::size_t i = cut.begin; i < cut.end; ++i) {
      wanted.T_submap_member.push_back(T_submap_world * T_world_sensor_[i]);
    }
    wanted.sketch = context_.work.FindSubmap(wanted.content, wanted.T_submap_member, tolerance_);
    return wanted;
  }

  Status Read(const BlobReader& read, Wanted& wanted) const {
    if (wanted.sketch) return {};
    for (std::size_t i = wanted.cut.begin; i < wanted.cut.end; ++i) {
      Result<Bytes> blob = read(i);
      if (!blob) return blob.error();
      wanted.blobs.push_back(*std::move(blob));
    }
    return {};
  }

  Status Fuse(Wanted& wanted) const {
    if (wanted.sketch) return {};
    std::vector<SubmapMember> members;
    for (std::size_t i = wanted.cut.begin; i < wanted.cut.end; ++i) {
      auto keyframe = Decode(i, wanted.blobs[i - wanted.cut.begin]);
      if (!keyframe) return keyframe.error();
      members.push_back({{session_.key, session_.keyframes[i].sequence},
                         session_.keyframes[i].time_ms,
                         T_world_sensor_[i],
                         std::make_shared<const Keyframe>(*std::move(keyframe))});
    }
    const auto submap = Submap::Fuse(members, NumberOf(session_, wanted.cut), context_.profile,
                                     context_.options.submaps);
    if (!submap) return submap.error();
    auto sketch = context_.work.KeepSubmap(wanted.content, wanted.T_submap_member, *submap);
    if (!sketch) return sketch.error();
    wanted.sketch = *std::move(sketch);
    wanted.blobs.clear();
    return {};
  }

 private:
  Result<Keyframe> Decode(std::size_t i, const Bytes& blob) const {
    const auto header = ReadKeyframeHeader(blob);
    Status status = header ? CheckKeyframeProfile(*header, context_.profile) : header.error();
    if (!status.ok()) return Error(status.WithContext(NameOf(session_, i)));
    Result<Keyframe> keyframe = DecodeKeyframe(blob);
    if (!keyframe) return Error(keyframe.error().WithContext(NameOf(session_, i)));
    if (Hash64(blob) == session_.keyframes[i].blob_hash) return keyframe;
    return Error(StatusCode::kInvalidData,
                 StrCat(NameOf(session_, i), ": other bytes than before"));
  }

  const MergeSession& session_;
  const std::vector<Pose>& T_world_sensor_;
  const MergeContext& context_;
  const ShapeTolerance& tolerance_;
};

// Of which keyframes a session consists, and how it is cut.
std::uint64_t HashOf(const MergeSession& session, const CutOptions& options) {
  ByteWriter out;
  out.U64(std::bit_cast<std::uint64_t>(options.length_m));
  out.U64(options.max_keyframes);
  out.U64(std::bit_cast<std::uint64_t>(options.jump_m));
  for (const MergeKeyframe& keyframe : session.keyframes) {
    out.U32(keyframe.sequence);
    out.I64(keyframe.time_ms);
    out.U64(keyframe.blob_hash);
  }
  return Hash64(out.bytes());
}

Result<std::vector<SubmapCut>> Cut(const MergeSession& session,
                                   std::uint64_t content,
                                   const MergeContext& context) {
  CutRecord record{content, {}};
  if (auto known = context.work.FindCut(record.session)) return *std::move(known);
  record.cuts = CutSession(StoredPoses(session), context.options.cut);
  Status status = context.work.KeepCut(record);
  if (!status.ok()) return Error(std::move(status));
  return std::move(record.cuts);
}

}  // namespace

Status BuildSubmaps(MergeSession& session,
                    const std::vector<Pose>& T_world_sensor,
                    const BlobReader& read,
                    const MergeContext& context,
                    const ShapeTolerance& tolerance,
                    const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  session.content = HashOf(session, context.options.cut);
  const auto cut = Cut(session, session.content, context);
  if (!cut) return cut.error();
  const std::vector<SubmapCut>& cuts = *cut;
  const std::size_t workers = context.options.workers;
  const std::size_t at_once = 4 * workers;
  const Builder builder(session, T_world_sensor, context, tolerance);
  std::vector<MergeSubmap> submaps;
  for (std::size_t first = 0; first < cuts.size(); first += at_once) {
    const std::size_t count = std::min(at_once, cuts.size() - first);
    std::vector<Wanted> wanted;
    for (std::size_t k = 0; k < count; ++k) {
      wanted.push_back(builder.Want(cuts[first + k]));
      ATLAS_RETURN_IF_ERROR(builder.Read(read, wanted.back()));
    }
    ATLAS_RETURN_IF_ERROR(RunParallel(
        count, workers, [&](std::size_t, std::size_t k) { return builder.Fuse(wanted[k]); }));
    for (Wanted& one : wanted) {
      submaps.push_back({one.cut, *std::move(one.sketch), one.T_world_submap});
    }
    if (progress) ATLAS_RETURN_IF_ERROR(progress(first + count, cuts.size()));
  }
  session.submaps = std::move(submaps);
  session.T_world_sensor = T_world_sensor;
  return {};
}

}  // namespace atlas
