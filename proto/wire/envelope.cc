#include "proto/wire/envelope.h"

#include <span>
#include <utility>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include "core/base/str_cat.h"
#include "proto/wire/message_shape.h"

namespace atlas {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

// Envelope, body, element, value: one more than the schema is deep.
constexpr int kMaxDepth = 5;

Status Malformed() {
  return Status(StatusCode::kInvalidData, "envelope: the frame's payload is not an Envelope");
}

Status TooMany(const char* what, std::uint32_t limit) {
  return Status(StatusCode::kInvalidData,
                StrCat("envelope: too many ", what, ", expected at most ", limit));
}

// Walks the wire format without allocating, along the schema, and counts what Protobuf would
// allocate for.
class ShapeCheck {
 public:
  // `max_bytes` at most, not counting what is in fields that are bytes.
  ShapeCheck(CodedInputStream& in, std::size_t max_bytes)
      : in_(in), bytes_left_(static_cast<std::int64_t>(max_bytes)) {}

  Status Message(const MessageShape& type) {
    while (const std::uint32_t tag = in_.ReadTag()) {
      ATLAS_RETURN_IF_ERROR(Field(type, tag));
    }
    return in_.ConsumedEntireMessage() ? Status() : Malformed();
  }

  bool has_unknown() const { return unknown_ > 0; }

 private:
  Status Field(const MessageShape& type, std::uint32_t tag) {
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    if (wire_type == WireFormatLite::WIRETYPE_START_GROUP ||
        wire_type == WireFormatLite::WIRETYPE_END_GROUP) {
      return Malformed();
    }
    const FieldShape* field = type.Find(WireFormatLite::GetTagFieldNumber(tag));
    if (field != nullptr && !field->CanBe(wire_type)) {
      field = nullptr;
    }
    if (field == nullptr && ++unknown_ > kMaxUnknownFields) {
      return TooMany("unknown fields", kMaxUnknownFields);
    }
    if (field != nullptr && field->is_repeated && ++repeated_ > kMaxRepeatedFields) {
      return TooMany("elements", kMaxRepeatedFields);
    }
    const bool is_delimited = wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
    if (field != nullptr && field->nested != nullptr && is_delimited) {
      return Nested(*field->nested);
    }
    const int begin = in_.CurrentPosition();
    if (field != nullptr && is_delimited && field->has_varints()) {
      ATLAS_RETURN_IF_ERROR(PackedVarints());
    } else if (!WireFormatLite::SkipField(&in_, tag)) {
      return Malformed();
    }
    const bool is_blob = field != nullptr && field->is_blob;
    bytes_left_ -= is_blob ? 1 : 1 + in_.CurrentPosition() - begin;
    return bytes_left_ >= 0 ? Status()
                            : Status(StatusCode::kResourceExhausted, "envelope: more than blobs");
  }

  // Numbers of one byte take up to eight in memory. Those of fixed size take what they came in.
  Status PackedVarints() {
    int size = 0;
    if (!in_.ReadVarintSizeAsInt(&size)) {
      return Malformed();
    }
    const CodedInputStream::Limit limit = in_.PushLimit(size);
    while (in_.BytesUntilLimit() > 0) {
      std::uint64_t number = 0;
      if (!in_.ReadVarint64(&number)) {
        return Malformed();
      }
      if (++repeated_ > kMaxRepeatedFields) {
        return TooMany("elements", kMaxRepeatedFields);
      }
    }
    in_.PopLimit(limit);
    return {};
  }

  Status Nested(const MessageShape& type) {
    int size = 0;
    if (!in_.ReadVarintSizeAsInt(&size)) {
      return Malformed();
    }
    const auto [limit, depth_left] = in_.IncrementRecursionDepthAndPushLimit(size);
    if (depth_left < 0) {
      return Malformed();
    }
    ATLAS_RETURN_IF_ERROR(Message(type));
    return in_.DecrementRecursionDepthAndPopLimit(limit) ? Status() : Malformed();
  }

  CodedInputStream& in_;
  std::int64_t bytes_left_;
  std::uint32_t unknown_ = 0;
  std::uint32_t repeated_ = 0;
};

// Whether it has fields that are not known.
Result<bool> CheckShape(ByteSpan payload, std::size_t max_bytes) {
  CodedInputStream in(payload.data(), static_cast<int>(payload.size()));
  in.SetRecursionLimit(kMaxDepth);
  ShapeCheck check(in, max_bytes);
  Status status = check.Message(MessageShape::OfEnvelope());
  if (!status.ok()) {
    return Error(std::move(status));
  }
  return check.has_unknown();
}

}  // namespace

Result<wire::Envelope> ParseEnvelope(ByteSpan payload) {
  if (payload.size() > kMaxFrameBytes) {
    return Error(StatusCode::kInvalidData,
                 StrCat("envelope: ", payload.size(), " bytes, expected at most ", kMaxFrameBytes));
  }
  const Result<bool> has_unknown = CheckShape(payload, payload.size());
  if (!has_unknown) {
    return Error(has_unknown.error());
  }
  CodedInputStream in(payload.data(), static_cast<int>(payload.size()));
  in.SetRecursionLimit(kMaxDepth);
  wire::Envelope envelope;
  if (!envelope.ParseFromCodedStream(&in) || !in.ConsumedEntireMessage()) {
    return Error(Malformed());
  }
  if (*has_unknown) {  // else looking for them takes as long as reading it did
    envelope.DiscardUnknownFields();
  }
  return envelope;
}

bool IsSmallBesidesBlobs(ByteSpan payload, std::size_t max_bytes) {
  return CheckShape(payload, max_bytes).has_value();
}

Result<Bytes> EncodeEnvelopeFrame(const wire::Envelope& envelope) {
  const std::size_t size = envelope.ByteSizeLong();
  if (size > kMaxFrameBytes) {
    return Error(StatusCode::kInvalidArgument, StrCat("envelope: message of ", size,
                                                      " bytes, expected at most ", kMaxFrameBytes));
  }
  Bytes frame(kFrameHeaderBytes + size);
  envelope.SerializeWithCachedSizesToArray(frame.data() + kFrameHeaderBytes);
  WriteHeader(HeaderOf(ByteSpan(frame).subspan(kFrameHeaderBytes)),
              std::span(frame).first<kFrameHeaderBytes>());
  return frame;
}

}  // namespace atlas
