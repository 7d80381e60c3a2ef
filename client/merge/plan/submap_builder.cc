#include "client/merge/plan/submap_builder.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "client/merge/plan/parallel.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
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

Result<MergeSubmap> FuseSubmap(const MergeSession& session,
                               const SubmapCut& cut,
                               std::span<const Bytes> blobs,
                               std::span<const Pose> T_world_sensor,
                               const MapProfile& profile,
                               const MergeOptions& options) {
  std::vector<SubmapMember> members;
  for (std::size_t i = cut.begin; i < cut.end; ++i) {
    const Bytes& blob = blobs[i - cut.begin];
    const auto header = ReadKeyframeHeader(blob);
    Status status = header ? CheckKeyframeProfile(*header, profile) : header.error();
    if (!status.ok()) return Error(status.WithContext(NameOf(session, i)));
    auto keyframe = DecodeKeyframe(blob);
    if (!keyframe) return Error(keyframe.error().WithContext(NameOf(session, i)));
    members.push_back({{session.key, session.keyframes[i].sequence},
                       session.keyframes[i].time_ms,
                       T_world_sensor[i],
                       std::make_shared<const Keyframe>(*std::move(keyframe))});
  }
  const std::uint64_t number = NumberOf(session, cut);
  Result<Submap> submap = Submap::Fuse(members, number, profile, options.submaps);
  if (!submap) return Error(submap.error());
  return MergeSubmap{cut, *std::move(submap), SubmapFrame(members, number)};
}

}  // namespace

Status BuildSubmaps(MergeSession& session,
                    const std::vector<Pose>& T_world_sensor,
                    const BlobReader& read,
                    const MapProfile& profile,
                    const MergeOptions& options,
                    const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  const std::vector<SubmapCut> cuts = CutSession(StoredPoses(session), options.cut);
  const std::size_t at_once = 4 * options.workers;
  session.T_world_sensor = T_world_sensor;
  session.submaps.clear();
  session.submaps.reserve(cuts.size());
  for (std::size_t first = 0; first < cuts.size(); first += at_once) {
    const std::size_t count = std::min(at_once, cuts.size() - first);
    std::vector<std::vector<Bytes>> blobs(count);
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = cuts[first + k].begin; i < cuts[first + k].end; ++i) {
        Result<Bytes> blob = read(i);
        if (!blob) return blob.error();
        blobs[k].push_back(*std::move(blob));
      }
    }
    std::vector<std::optional<MergeSubmap>> made(count);
    ATLAS_RETURN_IF_ERROR(
        RunParallel(count, options.workers, [&](std::size_t, std::size_t k) -> Status {
          auto submap =
              FuseSubmap(session, cuts[first + k], blobs[k], T_world_sensor, profile, options);
          if (!submap) return submap.error();
          made[k] = *std::move(submap);
          return {};
        }));
    for (std::optional<MergeSubmap>& one : made) {
      session.submaps.push_back(*std::move(one));
    }
    if (progress) ATLAS_RETURN_IF_ERROR(progress(first + count, cuts.size()));
  }
  return {};
}

}  // namespace atlas
