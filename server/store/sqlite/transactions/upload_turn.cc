#include "server/store/sqlite/transactions/upload_turn.h"

#include <exception>
#include <utility>

#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/transactions/transactions.h"

namespace atlas {
namespace {

// What is damaged is so here, for what was sent was looked at before: who sent it is told to send
// it again.
Status EndInStore(const Status& end) {
  return end.code() == StatusCode::kInvalidData ? Status(StatusCode::kUnavailable, end.message())
                                                : end;
}

}  // namespace

Result<PutKeyframeResult> PutInTurn(Connection& connection,
                                    const NewKeyframe& keyframe,
                                    UploadRoom& room) {
  if (Status status = keyframe.missing->CheckTurn(keyframe.key); !status.ok()) {
    return Error(std::move(status));
  }
  try {
    auto result = PutKeyframeInStore(connection, keyframe, room);
    keyframe.missing->NoteEnd(keyframe.key, result ? Status() : EndInStore(result.error()));
    return result;
  } catch (const std::exception& error) {
    keyframe.missing->NoteEnd(keyframe.key, EndInStore(StatusFromException(error)));
    throw;
  }
}

std::function<void(Result<PutKeyframeResult>)> Noting(
    const NewKeyframe& keyframe, std::function<void(Result<PutKeyframeResult>)> done) {
  return [missing = keyframe.missing, start = keyframe.start, key = keyframe.key,
          done = std::move(done)](Result<PutKeyframeResult> result) {
    const Status end = result ? Status() : result.error();
    if (missing != nullptr) {
      missing->NoteEnd(key, EndInStore(end));
    }
    if (start != nullptr) {
      start->NoteEnd(end);
    }
    done(std::move(result));
  };
}

}  // namespace atlas
