#include "server/net/requests/read_keyframes_reply.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/net/requests/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

// More than the last frame takes.
constexpr std::size_t kEndBytes = kFrameHeaderBytes + 52;
// Of what is damaged, for people: with it a frame is no larger than it counts for.
constexpr std::size_t kMostDamageBytes = 200;

// A reply under way.
struct Cursor {
  std::uint64_t request_id = 0;
  SessionKey session;
  std::optional<std::uint32_t> after;
  std::uint64_t left_bytes = 0;  // of the budget, but for the end
  std::uint64_t revision = 0;
  std::uint32_t keyframes = 0;  // sent
  std::uint64_t bytes = 0;
};

// Frames to be sent, and what the keyframe behind them counts for.
struct Batch {
  std::vector<Bytes> frames;
  std::optional<std::uint32_t> last;
  std::optional<std::size_t> next_bytes;
};

Result<Cursor> CursorFromWire(const wire::Envelope& request) {
  const wire::ReadKeyframes& message = request.read_keyframes();
  Cursor cursor;
  cursor.request_id = request.request_id();
  cursor.session = {message.vehicle(), message.session()};
  if (Status status = cursor.session.Validate(); !status.ok()) {
    return Error(std::move(status));
  }
  if (message.budget_bytes() != 0 && message.budget_bytes() < kEndBytes) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("keyframes: budget of ", message.budget_bytes(),
                        " bytes, expected at least ", kEndBytes));
  }
  cursor.left_bytes = message.budget_bytes() == 0 ? std::numeric_limits<std::uint64_t>::max()
                                                  : message.budget_bytes() - kEndBytes;
  if (message.has_after_sequence()) {
    cursor.after = message.after_sequence();
  }
  return cursor;
}

void ContentToWire(const KeyframeContent& content, wire::KeyframeMessage& out) {
  out.set_sequence(content.sequence);
  if (!content.damage.ok()) {
    out.set_damage(content.damage.message().substr(0, kMostDamageBytes));
    return;
  }
  out.set_time_ms(content.time_ms);
  *out.mutable_pose() = PoseToWire(content.pose);
  if (content.prior) {
    wire::PositionPrior& prior = *out.mutable_prior();
    prior.set_x_um(content.prior->x_um);
    prior.set_y_um(content.prior->y_um);
    prior.set_z_um(content.prior->z_um);
    prior.set_radius_mm(content.prior->radius_mm);
  }
  out.set_blob(BytesToWire(content.blob));
}

Result<Batch> ReadBatch(AtlasService& service, const Cursor& cursor, std::size_t max_bytes) {
  auto contents = service.ReadKeyframes(cursor.session, cursor.after, max_bytes);
  if (!contents) {
    return Error(contents.error());
  }
  Batch batch;
  batch.next_bytes = contents->next_bytes;
  for (KeyframeContent& content : contents->keyframes) {
    wire::Envelope envelope;
    envelope.set_request_id(cursor.request_id);
    ContentToWire(content, *envelope.mutable_keyframe());
    content.blob = Bytes();
    Result<Bytes> frame = EncodeEnvelopeFrame(envelope);
    if (!frame) {
      return Error(frame.error());
    }
    batch.frames.push_back(*std::move(frame));
    batch.last = content.sequence;
  }
  return batch;
}

// What has room already; `place`: of a large one.
void Send(Batch batch, const Places::Place& place, Cursor& cursor, ReplyWriter& out) {
  for (Bytes& frame : batch.frames) {
    ++cursor.keyframes;
    cursor.bytes += frame.size();
    cursor.left_bytes -= std::min<std::uint64_t>(cursor.left_bytes, frame.size());
    out.Push(ReplyFrame(std::move(frame)), place);
  }
  cursor.after = batch.last ? batch.last : cursor.after;
  out.Flush();
}

// The end counts itself: its own length depends on the number it carries.
wire::Envelope EndOf(const Cursor& cursor, bool has_more) {
  wire::Envelope envelope;
  envelope.set_request_id(cursor.request_id);
  wire::KeyframesEnd& end = *envelope.mutable_keyframes_end();
  end.set_keyframes(cursor.keyframes);
  end.set_revision(cursor.revision);
  end.set_has_more(has_more);
  end.set_bytes(cursor.bytes);
  for (int pass = 0; pass < 2; ++pass) {
    end.set_bytes(cursor.bytes + kFrameHeaderBytes + envelope.ByteSizeLong());
  }
  return envelope;
}

asio::awaitable<Result<Batch>> Read(RequestContext& context,
                                    const ReplyWriter& out,
                                    const Cursor& cursor,
                                    std::uint64_t max_bytes) {
  const Blocking<Batch> read = [&context, &cursor, max_bytes] {
    return ReadBatch(context.service, cursor, max_bytes);
  };
  co_return co_await context.reply_pool.Run(out.peer().whose(), std::nullopt, read);
}

// Whether something is left that the budget, or memory, has no room for.
asio::awaitable<Result<bool>> SendAll(RequestContext& context, Cursor& cursor, ReplyWriter& out) {
  while (true) {
    const ReplyWriter::Room room = co_await out.TakeRoom(kReplyBatchBytes);
    if (!room) {
      co_return Error(ReplyWriter::Room::Gone());
    }
    const std::uint64_t fitting = std::min<std::uint64_t>(room.bytes(), cursor.left_bytes);
    Result<Batch> batch = co_await Read(context, out, cursor, fitting);
    Places::Place place;
    if (batch && batch->frames.empty() && batch->next_bytes) {
      const std::size_t one = *batch->next_bytes;
      if (one > cursor.left_bytes) {
        co_return true;
      }
      if (one > kReplyBatchBytes) {
        Result<Places::Place> taken = context.works.Take(out.peer());
        if (!taken && cursor.keyframes > 0) {
          co_return true;
        }
        if (!taken) {
          co_return Error(taken.error());
        }
        place = *std::move(taken);
      }
      batch = co_await Read(context, out, cursor, one);
    }
    if (!batch) {
      co_return Error(batch.error());
    }
    const bool is_last = !batch->next_bytes;
    Send(*std::move(batch), place, cursor, out);
    if (is_last) {
      co_return false;
    }
  }
}

}  // namespace

asio::awaitable<Status> AnswerReadKeyframes(RequestContext& context,
                                            const wire::Envelope& request,
                                            Peer& peer) {
  Result<Cursor> cursor = CursorFromWire(request);
  if (!cursor) {
    co_return cursor.error();
  }
  TurnOrder::Turn turn(peer.streams);
  co_await turn.Come();
  cursor->revision = context.service.revision();
  const Result<bool> has_more = co_await SendAll(context, *cursor, peer.out);
  if (!has_more) {
    co_return has_more.error();
  }
  peer.out.Push(EndOf(*cursor, *has_more));
  peer.out.Flush();
  co_return Status();
}

}  // namespace atlas
