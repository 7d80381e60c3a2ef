#include "tests/fuzz/support/frame_packing.h"

#include <utility>

#include <google/protobuf/descriptor.h>

#include "proto/wire/frame.h"
#include "tests/fuzz/support/keyframe_packing.h"
#include "tests/fuzz/support/tile_packing.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kMaxBlobBytes = 16u << 10;
constexpr std::size_t kMaxFrames = 64;

Bytes StreamOf(const std::vector<Bytes>& payloads) {
  Bytes stream;
  for (const Bytes& payload : payloads) {
    const Bytes header = EncodeFrameHeader(payload);
    stream.insert(stream.end(), header.begin(), header.end());
    stream.insert(stream.end(), payload.begin(), payload.end());
  }
  return stream;
}

void Reorder(std::vector<Bytes>& payloads, Random& random) {
  const std::size_t at = random() % payloads.size();
  switch (random() % 3) {
    case 0:
      payloads.erase(payloads.begin() + static_cast<std::ptrdiff_t>(at));
      return;
    case 1:
      std::swap(payloads[at], payloads[random() % payloads.size()]);
      return;
    default:
      if (payloads.size() < kMaxFrames) {
        payloads.push_back(payloads[at]);
      }
  }
}

}  // namespace

Bytes FramesOf(const std::vector<wire::Envelope>& envelopes) {
  Bytes stream;
  for (const wire::Envelope& envelope : envelopes) {
    const Bytes frame = EncodeEnvelopeFrame(envelope).value();
    stream.insert(stream.end(), frame.begin(), frame.end());
  }
  return stream;
}

std::vector<Bytes> PayloadsOf(ByteSpan stream) {
  FrameDecoder decoder;
  decoder.Push(stream);
  std::vector<Bytes> payloads;
  for (auto payload = decoder.Next(); payload && *payload; payload = decoder.Next()) {
    payloads.emplace_back((*payload)->begin(), (*payload)->end());
  }
  return payloads;
}

Bytes MutateEnvelope(ByteSpan payload,
                     std::size_t max_size,
                     Random& random,
                     MutateBlob mutate_blob) {
  wire::Envelope envelope;
  if (OneIn(12, random) ||
      !envelope.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) {
    return Garbled(payload, max_size);
  }
  MutateMessage(envelope, random, mutate_blob);
  return BytesOf(envelope.SerializeAsString());
}

Bytes MutateFrames(ByteSpan stream, std::size_t max_size, Random& random, MutateBlob mutate_blob) {
  std::vector<Bytes> payloads = PayloadsOf(stream);
  if (payloads.empty() || OneIn(16, random)) {
    return Garbled(stream, max_size);
  }
  if (OneIn(6, random)) {
    Reorder(payloads, random);
  } else {
    Bytes& payload = payloads[random() % payloads.size()];
    payload = MutateEnvelope(payload, max_size, random, mutate_blob);
  }
  return StreamOf(payloads);
}

std::optional<Bytes> MutateWireBlob(const google::protobuf::FieldDescriptor& field,
                                    ByteSpan blob,
                                    Random& random) {
  if (field.containing_type() == wire::UploadKeyframe::descriptor()) {
    return MutatePacked(blob, kMaxBlobBytes, random, KeyframePacking());
  }
  if (field.containing_type() == wire::TileMessage::descriptor()) {
    return MutateTile(blob, kMaxBlobBytes, random);
  }
  return std::nullopt;
}

}  // namespace atlas::fuzz
