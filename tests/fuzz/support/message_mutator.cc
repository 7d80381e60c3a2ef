#include "tests/fuzz/support/message_mutator.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <google/protobuf/descriptor.h>

namespace atlas::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr std::size_t kMaxBlobBytes = 16u << 10;
constexpr int kMaxElements = 64;

// Where arithmetic goes wrong: around 0, at the ends of types, micrometres of tiles and continents,
// milliseconds of the year 2100, keys of tiles.
constexpr std::array<std::int64_t, 16> kEdges = {0,
                                                 1,
                                                 -1,
                                                 63,
                                                 255,
                                                 65'536,
                                                 1 << 30,
                                                 INT32_MAX,
                                                 INT32_MIN,
                                                 10'000'000'000'000,
                                                 -10'000'000'000'001,
                                                 4'102'444'800'000,
                                                 0x0300000000000000,
                                                 INT64_MAX,
                                                 INT64_MIN,
                                                 std::bit_cast<std::int64_t>(0xFFFFFFFF00000000)};

std::int64_t OtherNumber(std::int64_t value, Random& random) {
  switch (random() % 4) {
    case 0:
      return kEdges[random() % kEdges.size()];
    case 1:
      return static_cast<std::int64_t>(static_cast<std::uint64_t>(value) + random() % 17 - 8);
    case 2:
      return static_cast<std::int64_t>(static_cast<std::uint64_t>(value) ^ 1ULL << random() % 64);
    default: {
      ByteWriter number;
      number.I64(value);
      Bytes changed = Garbled(number.bytes(), number.size());
      changed.resize(number.size());
      return ByteReader(changed).I64();
    }
  }
}

std::string OtherText(const FieldDescriptor& field,
                      const std::string& value,
                      Random& random,
                      MutateBlob mutate_blob) {
  const Bytes bytes = BytesOf(value);
  const auto blob = mutate_blob == nullptr || OneIn(16, random) ? std::nullopt
                                                                : mutate_blob(field, bytes, random);
  std::string changed(TextOf(blob ? *blob : Garbled(bytes, std::max(kMaxBlobBytes, bytes.size()))));
  const bool is_text = field.type() == FieldDescriptor::TYPE_STRING;
  for (char& c : changed) {
    c = is_text ? static_cast<char>(c & 0x7f) : c;  // else it would not parse again
  }
  return changed;
}

// A field of a message, or one element of it.
class Place {
 public:
  Place(Message& message, const FieldDescriptor& field, int index)
      : message_(message), field_(field), index_(index), reflection_(*message.GetReflection()) {}

  void Change(Random& random, MutateBlob mutate_blob) {
    switch (field_.cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        MutateMessage(
            *(index_ < 0 ? reflection_.MutableMessage(&message_, &field_)
                         : reflection_.MutableRepeatedMessage(&message_, &field_, index_)),
            random, mutate_blob);
        return;
      case FieldDescriptor::CPPTYPE_STRING:
        SetText(OtherText(field_, Text(), random, mutate_blob));
        return;
      default:
        SetNumber(OtherNumber(Number(), random));
    }
  }

 private:
  std::string Text() const {
    return index_ < 0 ? reflection_.GetString(message_, &field_)
                      : reflection_.GetRepeatedString(message_, &field_, index_);
  }
  void SetText(std::string text) {
    index_ < 0 ? reflection_.SetString(&message_, &field_, std::move(text))
               : reflection_.SetRepeatedString(&message_, &field_, index_, std::move(text));
  }
  std::int64_t Number() const;
  void SetNumber(std::int64_t value);

  Message& message_;
  const FieldDescriptor& field_;
  int index_;  // -1: the field is not repeated
  const Reflection& reflection_;
};

// `Get` and `Set` of each type of number, of a field and of an element.
#define ATLAS_FUZZ_NUMBERS(X) \
  X(INT32, Int32)             \
  X(INT64, Int64)             \
  X(UINT32, UInt32)           \
  X(UINT64, UInt64)           \
  X(BOOL, Bool)               \
  X(ENUM, EnumValue)

std::int64_t Place::Number() const {
  switch (field_.cpp_type()) {
#define ATLAS_FUZZ_GET(TYPE, NAME)                            \
  case FieldDescriptor::CPPTYPE_##TYPE:                       \
    return static_cast<std::int64_t>(                         \
        index_ < 0 ? reflection_.Get##NAME(message_, &field_) \
                   : reflection_.GetRepeated##NAME(message_, &field_, index_));
    ATLAS_FUZZ_NUMBERS(ATLAS_FUZZ_GET)
#undef ATLAS_FUZZ_GET
    default:
      return 0;  // the protocol has no floating point
  }
}

void Place::SetNumber(std::int64_t value) {
  switch (field_.cpp_type()) {
#define ATLAS_FUZZ_SET(TYPE, NAME)                                                               \
  case FieldDescriptor::CPPTYPE_##TYPE: {                                                        \
    using Number = decltype(reflection_.Get##NAME(message_, &field_));                           \
    index_ < 0                                                                                   \
        ? reflection_.Set##NAME(&message_, &field_, static_cast<Number>(value))                  \
        : reflection_.SetRepeated##NAME(&message_, &field_, index_, static_cast<Number>(value)); \
    return;                                                                                      \
  }
    ATLAS_FUZZ_NUMBERS(ATLAS_FUZZ_SET)
#undef ATLAS_FUZZ_SET
    default:
      return;
  }
}

void AddElement(Message& message,
                const FieldDescriptor& field,
                Random& random,
                MutateBlob mutate_blob) {
  const Reflection& reflection = *message.GetReflection();
  const int count = reflection.FieldSize(message, &field);
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE: {
      Message& added = *reflection.AddMessage(&message, &field);
      if (count > 0) {
        added.CopyFrom(reflection.GetRepeatedMessage(
            message, &field, static_cast<int>(random() % static_cast<unsigned>(count))));
      }
      return;
    }
    case FieldDescriptor::CPPTYPE_STRING:
      reflection.AddString(&message, &field, "");
      break;
    case FieldDescriptor::CPPTYPE_UINT32:
      reflection.AddUInt32(&message, &field, 0);
      break;
    case FieldDescriptor::CPPTYPE_UINT64:
      reflection.AddUInt64(
          &message, &field,
          count > 0 ? reflection.GetRepeatedUInt64(message, &field, count - 1) : 0);
      break;
    default:
      return;  // the protocol repeats nothing else
  }
  Place(message, field, count).Change(random, mutate_blob);
}

void ChangeRepeated(Message& message,
                    const FieldDescriptor& field,
                    Random& random,
                    MutateBlob mutate_blob) {
  const Reflection& reflection = *message.GetReflection();
  const int count = reflection.FieldSize(message, &field);
  if (count == 0 || (count < kMaxElements && OneIn(3, random))) {
    AddElement(message, field, random, mutate_blob);
    return;
  }
  const int at = static_cast<int>(random() % static_cast<unsigned>(count));
  switch (random() % 6) {
    case 0:
      reflection.SwapElements(&message, &field, at, count - 1);
      reflection.RemoveLast(&message, &field);
      return;
    case 1:
      reflection.SwapElements(&message, &field, at,
                              static_cast<int>(random() % static_cast<unsigned>(count)));
      return;
    default:
      Place(message, field, at).Change(random, mutate_blob);
  }
}

// Those that are there, and now and then any other.
const FieldDescriptor& AnyField(const Message& message, Random& random) {
  std::vector<const FieldDescriptor*> set;
  message.GetReflection()->ListFields(message, &set);
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  if (!set.empty() && !OneIn(5, random)) {
    return *set[random() % set.size()];
  }
  return *type.field(static_cast<int>(random() % static_cast<unsigned>(type.field_count())));
}

}  // namespace

void MutateMessage(Message& message, Random& random, MutateBlob mutate_blob) {
  if (message.GetDescriptor()->field_count() == 0) {
    return;
  }
  const FieldDescriptor& field = AnyField(message, random);
  if (field.is_repeated()) {
    ChangeRepeated(message, field, random, mutate_blob);
  } else if (message.GetReflection()->HasField(message, &field) && OneIn(12, random)) {
    message.GetReflection()->ClearField(&message, &field);
  } else {
    Place(message, field, -1).Change(random, mutate_blob);
  }
}

}  // namespace atlas::fuzz
