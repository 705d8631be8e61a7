#include "tools/service/http/replies.h"

#include "tools/measure/report/page/encode.h"

namespace postchain::service {

Reply json_reply(int status, const std::string& text) {
    Reply reply;
    reply.status = status;
    reply.body = text + "\n";
    return reply;
}

ImageWanted image_wanted(const Call& call) {
    ImageWanted wanted;
    if (call.query("type") == "values") wanted.type = report::kPictureType;
    if (const auto side = number_of<int>(call.query("side"))) wanted.side = *side;
    return wanted;
}

std::vector<QueryParameter> image_queries() {
    return {{"type", "png: 8 bits; values: half floats for a page", {"png", "values"}},
            {"side", "largest width and height, 1 to 99999; default 320", {}, "[1-9][0-9]{0,4}"}};
}

std::function<void(Answer<Picture>)> image_to(const Respond& respond) {
    return [respond](const Answer<Picture>& answer) {
        respond(reply_to(answer, [](const Picture& picture) {
            Reply reply;
            reply.type = picture.type;
            reply.body = picture.bytes;
            return reply;
        }));
    };
}

Reply job_reply(int status, const Answer<Job>& answer) {
    return reply_to(answer, [status](const Job& job) {
        return json_reply(status, io::json_text(json_of(job, job_fields())));
    });
}

}  // namespace postchain::service
