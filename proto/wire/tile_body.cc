#include "proto/wire/tile_body.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "proto/wire/envelope.h"
#include "proto/wire/frame.h"

namespace atlas {
namespace {

constexpr std::uint32_t kVarint = 0;  // wire types of Protobuf
constexpr std::uint32_t kLengthDelimited = 2;
constexpr std::size_t kMaxTailBytes = 16;

std::uint64_t Tag(int field, std::uint32_t wire_type) {
  return static_cast<std::uint64_t>(field) << 3 | wire_type;
}

}  // namespace

Result<TileBody> TileBody::Create(const TileBodyId& id, ByteSpan blob) {
  wire::TileMessage message;
  message.set_key(id.key);
  message.set_revision(id.revision);
  message.set_payload_hash(id.payload_hash);
  message.set_base_hash(id.base_hash);
  ByteWriter tile;
  tile.Raw(BytesFromWire(message.SerializeAsString()));
  tile.Varint(Tag(wire::TileMessage::kBlobFieldNumber, kLengthDelimited));
  tile.Varint(blob.size());
  ByteWriter out;
  out.Varint(Tag(wire::Envelope::kTileFieldNumber, kLengthDelimited));
  out.Varint(tile.size() + blob.size());
  out.Raw(tile.bytes());
  if (out.size() + blob.size() + kMaxTailBytes > kMaxFrameBytes) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("tile: a blob of ", blob.size(), " bytes does not fit into a frame"));
  }
  TileBody body;
  body.id_ = id;
  body.blob_bytes_ = blob.size();
  body.bytes_.reserve(out.size() + blob.size());
  body.bytes_.insert(body.bytes_.end(), out.bytes().begin(), out.bytes().end());
  body.bytes_.insert(body.bytes_.end(), blob.begin(), blob.end());
  body.hash_.Add(body.bytes_);
  return body;
}

Bytes TileBody::FrameAround(std::uint64_t request_id) const {
  constexpr std::array<std::uint8_t, kFrameHeaderBytes> kNoHeaderYet{};
  ByteWriter out;
  out.Reserve(kFrameHeaderBytes + kMaxTailBytes);
  out.Raw(kNoHeaderYet);
  out.Varint(Tag(wire::Envelope::kRequestIdFieldNumber, kVarint));
  out.Varint(request_id);
  Bytes around = out.Take();
  const ByteSpan tail = ByteSpan(around).subspan(kFrameHeaderBytes);
  Hash64Stream hash = hash_;
  hash.Add(tail);
  WriteHeader({static_cast<std::uint32_t>(bytes_.size() + tail.size()),
               static_cast<std::uint32_t>(hash.value())},
              std::span(around).first<kFrameHeaderBytes>());
  return around;
}

}  // namespace atlas
