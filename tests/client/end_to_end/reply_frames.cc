#include "tests/client/end_to_end/reply_frames.h"

#include <stdexcept>

#include "proto/wire/envelope.h"
#include "proto/wire/frame.h"

namespace atlas {
namespace {

void Take(const wire::SyncManifest& manifest, ReplyFrames& frames) {
  for (const std::uint64_t key : manifest.keys()) {
    frames.announced.push_back(*TileId::FromKey(key));
  }
  frames.removed += static_cast<std::uint64_t>(manifest.removed_size());
  frames.differing += static_cast<std::uint64_t>(manifest.differing_blocks_size());
}

}  // namespace

ReplyFrames TakeApart(const Bytes& sent) {
  ReplyFrames frames;
  FrameDecoder decoder;
  decoder.Push(sent);
  while (decoder.pending_bytes() > 0) {
    const auto payload = decoder.Next();
    const auto envelope = payload && *payload
                              ? ParseEnvelope(**payload)
                              : Error(StatusCode::kInvalidData, "a frame is not whole");
    if (!envelope) throw std::runtime_error(envelope.error().message());
    if (envelope->has_sync_manifest()) Take(envelope->sync_manifest(), frames);
    if (envelope->has_tile()) frames.tiles.push_back(*TileId::FromKey(envelope->tile().key()));
    frames.ends.push_back(static_cast<std::int64_t>(sent.size() - decoder.pending_bytes()));
    frames.arrived.push_back(frames.tiles.size());
  }
  return frames;
}

}  // namespace atlas
