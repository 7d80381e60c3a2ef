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
  // `max_bytes` at most, not counting what is in fields that are bytes.
  ShapeCheck(CodedInputStream& in, std::size_t max_bytes)
      : in_(in), bytes_left_(static_cast<std::int64_t>(max_bytes)) {}

  Status Message(const Descriptor& type) {
    while (const std::uint32_t tag = in_.ReadTag()) {
      ATLAS_RETURN_IF_ERROR(Field(type, tag));
    }
    return in_.ConsumedEntireMessage() ? Status() : Malformed();
  }

  bool has_unknown() const { return unknown_ > 0; }

 private:
  Status Field(const Descriptor& type, std::uint32_t tag) {
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    if (wire_type == WireFormatLite::WIRETYPE_START_GROUP ||
        wire_type == WireFormatLite::WIRETYPE_END_GROUP) {
      return Malformed();
    }
    const FieldDescriptor* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    if (field != nullptr && !CanBe(*field, wire_type)) {
      field = nullptr;  // Protobuf keeps it as one that it does not know
    }
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
    const bool is_blob = field != nullptr && field->type() == FieldDescriptor::TYPE_BYTES;
    const int begin = in_.CurrentPosition();
    if (field != nullptr && wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED &&
        HasVarints(*field)) {
      ATLAS_RETURN_IF_ERROR(PackedVarints());
    } else if (!WireFormatLite::SkipField(&in_, tag)) {
      return Malformed();
    }
    bytes_left_ -= is_blob ? 1 : 1 + in_.CurrentPosition() - begin;
    return bytes_left_ >= 0 ? Status()
                            : Status(StatusCode::kResourceExhausted, "envelope: more than blobs");
  }

  static WireFormatLite::WireType WireTypeOf(const FieldDescriptor& field) {
    return WireFormatLite::WireTypeForFieldType(
        static_cast<WireFormatLite::FieldType>(field.type()));
  }

  static bool CanBe(const FieldDescriptor& field, WireFormatLite::WireType wire_type) {
    return wire_type == WireTypeOf(field) ||
           (field.is_packable() && wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
  }

  static bool HasVarints(const FieldDescriptor& field) {
    return field.is_packable() && WireTypeOf(field) == WireFormatLite::WIRETYPE_VARINT;
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
  std::int64_t bytes_left_;
  std::uint32_t unknown_ = 0;
  std::uint32_t repeated_ = 0;
};

// Whether it has fields that are not known.
Result<bool> CheckShape(ByteSpan payload, std::size_t max_bytes) {
  CodedInputStream in(payload.data(), static_cast<int>(payload.size()));
  in.SetRecursionLimit(kMaxDepth);
  ShapeCheck check(in, max_bytes);
  Status status = check.Message(*wire::Envelope::descriptor());
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
  const Bytes header = EncodeFrameHeader(ByteSpan(frame).subspan(kFrameHeaderBytes));
  std::copy(header.begin(), header.end(), frame.begin());
  return frame;
}

}  // namespace atlas
