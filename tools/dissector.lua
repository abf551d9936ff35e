local link_proto = Proto("eldorado", "El Dorado link")
F.payload = ProtoField.bytes("eldorado.payload", "payload")
F.tag = ProtoField.bytes("eldorado.tag", "tag")
F.data = ProtoField.bytes("eldorado.data", "data")
F.bits = ProtoField.bytes("eldorado.bits", "bits from the base on")
F.value = ProtoField.double("eldorado.report.value", "value")
F.text = ProtoField.string("eldorado.report.text", "text", base.UNICODE)
F.name = ProtoField.string("eldorado.announcement.name", "name", base.UNICODE)
F.codec = ProtoField.string("eldorado.announcement.codec", "codec", base.UNICODE)
F.argument = ProtoField.string("eldorado.telecommand.argument", "argument", base.UNICODE)
F.bad = ProtoField.string("eldorado.bad", "malformed", base.UNICODE)
for _, field in pairs(F) do
    table.insert(link_proto.fields, field)
end

-- Each reader takes a buffer, the tree and where it begins, and gives where it ends; nil: the rest is too short.

local function struct(name, buffer, tree, at)
    local values = {}
    for i, row in ipairs(READ[name]) do
        if at + row[2] > buffer:len() then
            tree:add(F.bad, buffer(), name .. " is cut off")
            return nil
        end
        local range = buffer(at, row[2])
        tree:add_le(row[1], range)
        values[i] = row[2] <= 4 and range:le_uint() or 0
        at = at + row[2]
    end
    return at, values
end

local function rest(field, buffer, tree, at)
    if at < buffer:len() then
        tree:add(field, buffer(at))
    end
end

local argument_readers = {}

function argument_readers.number(row, buffer, at)
    if at + 8 > buffer:len() then return nil end
    local value = buffer(at, 8):le_float()
    local told = value ~= value and "left out" or string.format("%.10g", value)
    if value == value and row[3] ~= "" then told = told .. " " .. row[3] end
    return at + 8, told
end

function argument_readers.choice(row, buffer, at)
    if at + 8 > buffer:len() then return nil end
    local value = buffer(at, 8):le_float()
    return at + 8, value ~= value and "left out" or row[4][value + 1] or "no such choice"
end

function argument_readers.text(row, buffer, at)
    if at >= buffer:len() then return nil end
    local length = buffer(at, 1):uint()
    if at + 1 + length > buffer:len() then return nil end
    if length == 0 then return at + 1, "left out" end
    return at + 1 + length, buffer(at + 1, length):string(ENC_UTF_8)
end

function argument_readers.points(row, buffer, at)
    if at >= buffer:len() then return nil end
    local count, told = buffer(at, 1):uint(), {}
    if at + 1 + 8 * count > buffer:len() then return nil end
    for i = 0, 2 * count - 1 do
        table.insert(told, string.format("%.3f", buffer(at + 1 + 4 * i, 4):le_int() / 1000))
    end
    return at + 1 + 8 * count, table.concat(told, " ") .. " " .. row[3]
end

local payloads = {}

function payloads.MAVLINK(buffer, tree, pinfo)
    mavlink_proto.dissector(buffer, pinfo, tree)
end

function payloads.TELECOMMAND(buffer, tree, pinfo)
    local at, values = struct("telecommand", buffer, tree, 0)
    if not at then return end
    local id = values[5]
    pinfo.cols.info = string.format("%s #%d", COMMANDS[id] or "unknown command", values[1])
    for _, row in ipairs(ARGUMENTS[id] or {}) do
        local stop, told = argument_readers[row[2]](row, buffer, at)
        if not stop then
            tree:add(F.bad, buffer(), row[1] .. " is cut off")
            return
        end
        tree:add(F.argument, buffer(at, stop - at), row[1] .. " = " .. told)
        at = stop
    end
end

function payloads.REPORT(buffer, tree, pinfo, down)
    if not down then
        pinfo.cols.info = "acknowledgement of events"
        local at = struct("acknowledgement", buffer, tree, 0)
        if at then rest(F.bits, buffer, tree, at) end
        return
    end
    local at, values = struct("report", buffer, tree, 0)
    if not at then return end
    pinfo.cols.info = string.format("#%d of station %d %s", values[1], values[2], STATES[values[4]] or "?")
    for _ = 1, values[6] do
        if at + 8 > buffer:len() then
            tree:add(F.bad, buffer(), "values are cut off")
            return
        end
        tree:add_le(F.value, buffer(at, 8))
        at = at + 8
    end
    if at < buffer:len() then
        tree:add_packet_field(F.text, buffer(at), ENC_UTF_8)
    end
end

function payloads.BULK_CHUNK(buffer, tree, pinfo)
    local at, values = struct("chunk", buffer, tree, 0)
    if not at then return end
    if values[3] ~= ANNOUNCEMENT then
        pinfo.cols.info = string.format("object %d, chunk %d", values[1], values[3])
        rest(F.data, buffer, tree, at)
        return
    end
    pinfo.cols.info = string.format("object %d, announcement", values[1])
    at, values = struct("announcement", buffer, tree, at)
    if not at then return end
    if at + values[4] + values[5] > buffer:len() then
        tree:add(F.bad, buffer(), "names are cut off")
        return
    end
    tree:add_packet_field(F.name, buffer(at, values[4]), ENC_UTF_8)
    tree:add_packet_field(F.codec, buffer(at + values[4], values[5]), ENC_UTF_8)
end

function payloads.BULK_BITMAP(buffer, tree, pinfo)
    local at, values = struct("bitmap", buffer, tree, 0)
    if not at then return end
    pinfo.cols.info = string.format("object %d, has all below %d", values[1], values[4])
    rest(F.bits, buffer, tree, at)
end

function link_proto.dissector(buffer, pinfo, tree)
    pinfo.cols.protocol = "El Dorado"
    local top = tree:add(link_proto, buffer(), "El Dorado link (" .. buffer:len() .. " B)")
    local at, values = struct("header", buffer, top, 0)
    if not at then return end
    local size = buffer:len() - at - TAG_BYTES
    if size <= 0 then
        top:add(F.bad, buffer(), size < 0 and "the tag is cut off" or "no payload")
        return
    end
    local name = KINDS[values[1]]
    local station = "station " .. values[2]
    local down = values[2] == DOWNLINK_KEY_ID
    pinfo.cols.src = down and "rover" or station
    pinfo.cols.dst = down and "ground" or "rover"
    local part = top:add(F.payload, buffer(at, size))
    if payloads[name] then
        payloads[name](buffer(at, size):tvb(), part, pinfo, down)
    end
    if pinfo.cols.info ~= nil and name ~= "MAVLINK" then
        pinfo.cols.info:prepend((name or "unknown kind") .. ": ")
    end
    top:add(F.tag, buffer(at + size, TAG_BYTES))
end

-- A capture of the link's datagrams has link type USER0; the gateway speaks MAVLink on UDP.
DissectorTable.get("wtap_encap"):add(wtap.USER0, link_proto)
local ports = DissectorTable.get("udp.port")
ports:add_for_decode_as(link_proto)
ports:add(14550, mavlink_proto)
ports:add(14551, mavlink_proto)
