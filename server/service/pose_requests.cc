#include "server/service/pose_requests.h"

#include <set>
#include <utility>

#include "core/base/str_cat.h"
#include "server/service/upload_check.h"

namespace atlas {
namespace {

Status CheckNames(const PoseBatchRequest& request) {
  ATLAS_RETURN_IF_ERROR(CheckAuthor(request.author));
  if (request.published.size() > kMaxPublishedSessions) {
    return {StatusCode::kInvalidArgument,
            StrCat("pose batch: ", request.published.size(), " sessions to publish, at most ",
                   kMaxPublishedSessions)};
  }
  for (const SessionKey& key : request.published) {
    ATLAS_RETURN_IF_ERROR(key.Validate());
  }
  return {};
}

Status CheckCondition(AtlasStore& store, const PoseBatchRequest& request) {
  if (request.if_revision == 0) {
    return {};
  }
  std::set<SessionKey> sessions(request.published.begin(), request.published.end());
  for (const PoseBatchRequest::Update& update : request.updates) {
    sessions.insert(update.key.session);
  }
  return store.CheckUnchanged(sessions, request.if_revision);
}

}  // namespace

Result<PoseBatch> PlacePoses(AtlasStore& store, PoseBatchRequest request) {
  Status status = CheckNames(request);
  status = status.ok() ? CheckCondition(store, request) : std::move(status);
  if (!status.ok()) {
    return Error(std::move(status));
  }
  std::vector<KeyframeKey> keys;
  keys.reserve(request.updates.size());
  for (const PoseBatchRequest::Update& update : request.updates) {
    keys.push_back(update.key);
  }
  const auto keyframes = store.FindKeyframes(keys);
  if (!keyframes) {
    return Error(keyframes.error());
  }
  PoseBatch batch{{}, std::move(request.author), request.if_revision, std::move(request.published)};
  batch.poses.reserve(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const QuantizedPose& update = request.updates[i].pose;
    const auto& keyframe = (*keyframes)[i];
    auto pose = keyframe ? CheckPose(*keyframe, update, store.identity().profile)
                         : CheckDroppedPose(keys[i], update);
    if (!pose) {
      return Error(pose.error());
    }
    batch.poses.push_back(std::move(*pose));
  }
  return batch;
}

Result<PoseUndo> PlaceUndo(AtlasStore& store, PoseUndoRequest request) {
  if (Status status = CheckAuthor(request.author); !status.ok()) {
    return Error(std::move(status));
  }
  const auto changed = store.ReadBatchToUndo(request.batch);
  if (!changed) {
    return Error(changed.error());
  }
  PoseUndo undo{request.batch, {}, std::move(request.author)};
  undo.poses.reserve(changed->keyframes.size());
  for (const auto& [keyframe, before] : changed->keyframes) {
    auto pose = CheckPose(keyframe, before, store.identity().profile);
    if (!pose) {
      return Error(pose.error());
    }
    undo.poses.push_back(*std::move(pose));
  }
  return undo;
}

}  // namespace atlas
