#include "tools/service/http/replies.h"

namespace postchain::service {

Reply json_reply(int status, const std::string& text) {
    Reply reply;
    reply.status = status;
    reply.body = text + "\n";
    return reply;
}

Reply image_reply(const Answer<Picture>& answer) {
    return reply_to(answer, [](const Picture& picture) {
        Reply reply;
        reply.type = picture.type;
        reply.body = picture.bytes;
        return reply;
    });
}

Reply job_reply(int status, const Answer<Job>& answer) {
    return reply_to(answer, [status](const Job& job) {
        return json_reply(status, io::json_text(json_of(job, job_fields())));
    });
}

}  // namespace postchain::service
