#include "proto/wire/envelope.h"

#include <algorithm>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
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
  explicit ShapeCheck(CodedInputStream& in) : in_(in) {}

  Status Message(const Descriptor& type) {
    while (const std::uint32_t tag = in_.ReadTag()) {
      ATLAS_RETURN_IF_ERROR(Field(type, tag));
    }
    return in_.ConsumedEntireMessage() ? Status() : Malformed();
  }

 private:
  Status Field(const Descriptor& type, std::uint32_t tag) {
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    if (wire_type == WireFormatLite::WIRETYPE_START_GROUP ||
        wire_type == WireFormatLite::WIRETYPE_END_GROUP) {
      return Malformed();
    }
    const FieldDescriptor* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    if (field == nullptr && ++unknown_ > kMaxUnknownFields) {
      return TooMany("unknown fields", kMaxUnknownFields);
    }
    if (field != nullptr && field->is_repeated() && ++repeated_ > kMaxRepeatedFields) {
      return TooMany("elements", kMaxRepeatedFields);
    }
    const bool is_nested = field != nullptr && field->message_type() != nullptr &&
                           wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
    if (is_nested) {
      return Nested(*field->message_type());
    }
    return WireFormatLite::SkipField(&in_, tag) ? Status() : Malformed();
  }

  Status Nested(const Descriptor& type) {
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
  std::uint32_t unknown_ = 0;
  std::uint32_t repeated_ = 0;
};

}  // namespace

Result<wire::Envelope> ParseEnvelope(ByteSpan payload) {
  if (payload.size() > kMaxFrameBytes) {
    return Error(StatusCode::kInvalidData,
                 StrCat("envelope: ", payload.size(), " bytes, expected at most ", kMaxFrameBytes));
  }
  CodedInputStream shape(payload.data(), static_cast<int>(payload.size()));
  shape.SetRecursionLimit(kMaxDepth);
  if (Status status = ShapeCheck(shape).Message(*wire::Envelope::descriptor()); !status.ok()) {
    return Error(std::move(status));
  }
  CodedInputStream in(payload.data(), static_cast<int>(payload.size()));
  in.SetRecursionLimit(kMaxDepth);
  wire::Envelope envelope;
  if (!envelope.ParseFromCodedStream(&in) || !in.ConsumedEntireMessage()) {
    return Error(Malformed());
  }
  envelope.DiscardUnknownFields();
  return envelope;
}

Result<Bytes> EncodeEnvelopeFrame(const wire::Envelope& envelope) {
  const std::size_t size = envelope.ByteSizeLong();
  if (size > kMaxFrameBytes) {
    return Error(StatusCode::kInvalidArgument, StrCat("envelope: message of ", size,
                                                      " bytes, expected at most ", kMaxFrameBytes));
  }
  Bytes frame(kFrameHeaderBytes + size);
  envelope.SerializeWithCachedSizesToArray(frame.data() + kFrameHeaderBytes);
  const Bytes header = EncodeFrameHeader(ByteSpan(frame).subspan(kFrameHeaderBytes));
  std::copy(header.begin(), header.end(), frame.begin());
  return frame;
}

}  // namespace atlas
