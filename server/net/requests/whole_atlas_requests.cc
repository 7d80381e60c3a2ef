#include "server/net/requests/whole_atlas_requests.h"

#include <utility>

#include "server/net/requests/answer.h"
#include "server/net/requests/atlas_wait.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

// Until nothing is dirty, damaged tiles neither.
asio::awaitable<Status> RequireUndamaged(RequestContext& context, const Patience& patience) {
  const Result<WaitOutcome> settled =
      co_await RequireSettled(context.service, context.pool, patience);
  co_return settled ? settled->damage : settled.error();
}

asio::awaitable<Result<AtlasDigest>> ComputeDigest(RequestContext& context,
                                                   const wire::DigestRequest& message,
                                                   const Patience& patience,
                                                   FairPool::Whose whose) {
  FairPool& pool = context.reading_pool;
  if (message.has_at_revision()) {
    const Blocking<AtlasDigest> compute = [&context, revision = message.at_revision(), patience] {
      return context.service.DigestAt(revision, patience);
    };
    co_return co_await pool.Run(whose, patience.deadline, compute);
  }
  const Status settled = co_await RequireUndamaged(context, patience);
  if (!settled.ok()) {
    co_return Error(settled);
  }
  const Blocking<AtlasDigest> compute = [&context, patience] {
    return context.service.Digest(patience);
  };
  co_return co_await pool.Run(whose, patience.deadline, compute);
}

Result<CompactionRequest> ReadCompaction(const AtlasService& service,
                                         const wire::CompactRequest& message) {
  CompactionRequest compaction = CompactionFromWire(message);
  if (Status status = CheckCompaction(compaction, service.identity().profile); !status.ok()) {
    return Error(std::move(status));
  }
  return compaction;
}

}  // namespace

asio::awaitable<Status> AnswerWait(RequestContext& context,
                                   const Request& whole,
                                   RequestRecord& record,
                                   ReplyWriter& out) {
  const Result<Places::Place> place = context.waits.Take(out.peer());
  if (!place) {
    co_return place.error();
  }
  const wire::Envelope& request = *whole.message;
  const Patience patience = PatienceOf(whole, request.wait_request().timeout_ms(), out);
  const Result<WaitOutcome> outcome =
      co_await WaitUntilClean(context.service, context.pool, patience);
  if (outcome && !outcome->damage.ok()) {
    co_return outcome->damage;
  }
  if (outcome && outcome->is_timed_out) {
    record.NoteLate();
  }
  co_return co_await Answer(request, outcome, &wire::Envelope::mutable_wait_reply, WaitToWire, out);
}

asio::awaitable<Status> AnswerDigest(RequestContext& context,
                                     const Request& whole,
                                     ReplyWriter& out) {
  const Result<Places::Place> place = context.works.Take(out.peer());
  if (!place) {
    co_return place.error();
  }
  const wire::Envelope& request = *whole.message;
  const wire::DigestRequest& message = request.digest_request();
  const Patience patience = PatienceOf(whole, message.timeout_ms(), out);
  const Result<AtlasDigest> digest =
      co_await ComputeDigest(context, message, patience, out.peer().whose());
  co_return co_await Answer(request, digest, &wire::Envelope::mutable_digest_reply, DigestToWire,
                            out);
}

asio::awaitable<Status> AnswerVerify(RequestContext& context,
                                     const Request& whole,
                                     ReplyWriter& out) {
  const Result<Places::Place> place = context.works.Take(out.peer());
  if (!place) {
    co_return place.error();
  }
  VerifyRequest verify = VerifyFromWire(whole.message->verify_request());
  verify.author = AuthorOf(out.peer().name, std::move(verify.author));
  if (Status status = CheckAuthor(verify.author); !status.ok()) {
    co_return status;
  }
  const wire::Envelope& request = *whole.message;
  const Patience patience = PatienceOf(whole, request.verify_request().timeout_ms(), out);
  if (verify.rebuild && !verify.repair) {  // damage is what it is to report
    const Result<WaitOutcome> settled =
        co_await RequireSettled(context.service, context.pool, patience);
    if (!settled) {
      co_return settled.error();
    }
  }
  const Blocking<VerifyReport> check = [&context, &verify, patience] {
    return context.service.Verify(verify, patience);
  };
  const Result<VerifyReport> report =
      co_await context.reading_pool.Run(out.peer().whose(), patience.deadline, check);
  co_return co_await Answer(request, report, &wire::Envelope::mutable_verify_reply, VerifyToWire,
                            out);
}

asio::awaitable<Status> AnswerCompact(RequestContext& context,
                                      const Request& whole,
                                      ReplyWriter& out) {
  const wire::Envelope& request = *whole.message;
  const Blocking<CompactionRequest> read = [&context, &request] {
    return ReadCompaction(context.service, request.compact_request());
  };
  Result<CompactionRequest> compaction = co_await OnPool(context.pool, read);
  if (!compaction) {
    co_return compaction.error();  // before any wait
  }
  compaction->author = AuthorOf(out.peer().name, std::move(compaction->author));
  const Result<Places::Place> place = context.works.Take(out.peer());
  if (!place) {
    co_return place.error();
  }
  const Patience patience = PatienceOf(whole, request.compact_request().timeout_ms(), out);
  const Result<WaitOutcome> settled =
      co_await RequireSettled(context.service, context.pool, patience);
  if (!settled) {
    co_return settled.error();
  }
  const Blocking<CompactionReport> compact = [&context, &compaction, patience] {
    return context.service.Compact(*compaction, patience);
  };
  const Result<CompactionReport> report =
      co_await context.reading_pool.Run(out.peer().whose(), patience.deadline, compact);
  co_return co_await Answer(request, report, &wire::Envelope::mutable_compact_reply,
                            CompactionToWire, out);
}

}  // namespace atlas
