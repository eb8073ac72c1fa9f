function units = isotherm(path)
% ISOTHERM  Corrected ticks of a file, for MATLAB and GNU Octave.
%
%   units = isotherm('run.mcap')          a recording
%   units = isotherm('corrected.wire')    frames of: isotherm-replay correct --format wire
%   ticks = isotherm('corrected.parquet') columns by name of: isotherm-replay convert --to parquet; a table in MATLAB
%
%   units(k).unit is a serial; units(k).sequence, .end_time_ns, .duration_ns, .ticks, .missed, .mode (1, -1, 0: none), .flags,
%   .revision, .series have a row for each output, .delta_angle_rad and .delta_velocity_m_per_s three columns, .gyro_flags and .accel_flags
%   eight, of which .gyros and .accels count; .angle_sigma_rad and .velocity_sigma_m_per_s have twelve: x, y, z by noise, by
%   restoration, by calibration, by clamping; NaN where unknown or not asked for. Bits and fields: docs/wire.md. Frames that cannot be read are passed over with a
%   warning that says how many and why. Recordings compressed with zstd need the program zstd on the path.
  [~, ~, extension] = fileparts(path);
  if strcmp(extension, '.parquet')
    if exist('parquetread', 'file') ~= 0
      units = parquetread(path);
      return
    end
    bytes = contents(path);
    try
      units = parquet_columns(bytes);
    catch problem
      error('isotherm:file', '%s: no whole Parquet file of isotherm-replay convert: %s', path, problem.message);
    end
    return
  end
  bytes = contents(path);
  if numel(bytes) >= 8 && isequal(bytes(1:8), uint8([137 77 67 65 80 48 13 10]))
    frames = mcap_frames(bytes, path);
  else
    frames = wire_frames(bytes, path);
  end
  serials = {}; parts = {}; refused = 0; reason = '';
  for k = 1:numel(frames)
    try
      [serial, part] = decode(frames{k});
    catch problem
      if ~strcmp(problem.identifier, 'isotherm:refused'), rethrow(problem); end
      refused = refused + 1;
      reason = problem.message;
      continue
    end
    place = find(strcmp(serials, serial), 1);
    if isempty(place)
      place = numel(serials) + 1;
      serials{place} = serial;
      parts{place} = {};
    end
    parts{place}{end + 1} = part;
  end
  if refused > 0
    warning('isotherm:refused', '%s: %d of %d frames cannot be read; the last: %s', path, refused, numel(frames), reason);
  end
  units = struct('unit', {});
  for place = 1:numel(serials)
    units(place).unit = serials{place};
    for name = fieldnames(parts{place}{1})'
      columns = cellfun(@(part) part.(name{1}), parts{place}, 'UniformOutput', false);
      units(place).(name{1}) = vertcat(columns{:});
    end
  end
end

function bytes = contents(path)
  file = fopen(path, 'r', 'ieee-le');
  if file < 0
    error('isotherm:file', '%s: cannot be opened', path);
  end
  bytes = fread(file, Inf, '*uint8')';
  fclose(file);
end

function frames = wire_frames(bytes, path)
  frames = {}; at = 1;
  while at <= numel(bytes)
    if at + 3 > numel(bytes), cut_short(path, at); end
    count = number(bytes(at:at + 3));
    if count > 1048576
      error('isotherm:file', '%s: at byte %d a frame of %d bytes, at most 1048576', path, at - 1, count);
    end
    if at + 3 + count > numel(bytes), cut_short(path, at); end
    frames{end + 1} = bytes(at + 4:at + 3 + count);
    at = at + 4 + count;
  end
end

function cut_short(path, at)
  error('isotherm:file', '%s: cut short at byte %d; of a recording, try isotherm-replay recover', path, at - 1);
end

function value = number(bytes)
% A little-endian number below 2^53.
  value = sum(double(bytes) .* 256 .^ (0:numel(bytes) - 1));
end

function frames = mcap_frames(bytes, path)
  [frames, ~] = records(bytes, 9, {}, containers.Map('KeyType', 'double', 'ValueType', 'logical'), path);
end

function [frames, corrected] = records(bytes, at, frames, corrected, path)
% Frames of corrected topics among the records from a place; `corrected` has the channels that carry them.
  while at + 8 <= numel(bytes)
    opcode = bytes(at);
    count = number(bytes(at + 1:at + 8));
    from = at + 9;
    at = from + count;
    if opcode == 2, return; end
    if at - 1 > numel(bytes), cut_short(path, from - 9); end
    body = bytes(from:at - 1);
    if opcode == 4 && count >= 8
      topic = char(body(9:min(end, 8 + number(body(5:8)))));
      corrected(number(body(1:2))) = ~isempty(regexp(topic, '(^|/)imu/[^/]+/corrected$', 'once'));
    elseif opcode == 5 && count >= 22
      id = number(body(1:2));
      if isKey(corrected, id) && corrected(id), frames{end + 1} = body(23:end); end
    elseif opcode == 6 && count >= 40
      length = number(body(29:32));
      compression = char(body(33:min(end, 32 + length)));
      inner = body(41 + length:end);
      if strcmp(compression, 'zstd')
        inner = unzstd(inner, path);
      elseif ~isempty(compression)
        error('isotherm:file', '%s: compressed with %s, which is not read here', path, compression);
      end
      [frames, corrected] = records(inner, 1, frames, corrected, path);
    end
  end
end

function bytes = unzstd(bytes, path)
  base = tempname();
  packed = [base '.zst'];
  file = fopen(packed, 'w'); fwrite(file, bytes); fclose(file);
  [status, words] = system(sprintf('zstd -d -q -f "%s" -o "%s"', packed, base));
  delete(packed);
  if status ~= 0
    error('isotherm:file', '%s: zstd cannot unpack it; is the program installed? %s', path, strtrim(words));
  end
  file = fopen(base, 'r'); bytes = fread(file, Inf, '*uint8')'; fclose(file);
  delete(base);
end

function refuse(varargin)
  error('isotherm:refused', varargin{:});
end

function [unit, out] = decode(frame)
  count = numel(frame);
  if count < 6 || count > 1048576, refuse('a frame of %d bytes', count); end
  if frame(1) ~= 4, refuse('kind %d, not 4', frame(1)); end
  if frame(2) < 1 || frame(2) > 3, refuse('version %d is not known here', frame(2)); end
  if number(frame(end - 3:end)) ~= crc32(frame(1:end - 4)), refuse('the checksum does not fit'); end
  body = frame(3:end - 4);
  [length, at] = varint(body, 1, 64);
  at = skip(body, at, length);
  unit = char(body(at - double(length):at - 1));
  series = uint64(0);
  if frame(2) == 3, [series, at] = varint(body, at, 64); end
  [revision, at] = varint(body, at, 64);
  at = skip(body, at, 8);
  [channels, at] = varint(body, at, 64);
  if channels > 16, refuse('%d channels', channels); end
  for k = 1:channels
    [length, at] = varint(body, at, 64);
    if length > 24, refuse('a channel name of %d bytes', length); end
    at = skip(body, at, length);
    at = skip(body, at, 16);
  end
  [left, at] = varint(body, at, 64);
  if left < 1 || left > 4096, refuse('a batch of %d ticks', left); end
  left = double(left);
  parts = {};
  while left > 0
    [parts{end + 1}, at] = alike(body, at, left);
    left = left - numel(parts{end}.sequence);
  end
  ticks = sum(cellfun(@(part) numel(part.sequence), parts));
  angle = NaN(ticks, 12); velocity = NaN(ticks, 12);
  if frame(2) > 1
    [runs, at] = varint(body, at, 64);
    if runs < 3 - double(frame(2)) || runs > 4096, refuse('%d runs of standard errors', runs); end
    for k = 1:double(runs)
      [from, at] = varint(body, at, 16);
      numbers = at;
      at = skip(body, at, 192);
      numbers = typecast(body(numbers:at - 1), 'double');
      angle(double(from) + 1:ticks, :) = repmat(numbers(1:12), max(0, ticks - double(from)), 1);
      velocity(double(from) + 1:ticks, :) = repmat(numbers(13:24), max(0, ticks - double(from)), 1);
    end
  end
  if at <= numel(body), refuse('%d bytes are left over', numel(body) - at + 1); end
  for name = fieldnames(parts{1})'
    columns = cellfun(@(part) part.(name{1}), parts, 'UniformOutput', false);
    out.(name{1}) = vertcat(columns{:});
  end
  out.angle_sigma_rad = angle; out.velocity_sigma_m_per_s = velocity;
  out.revision = repmat(revision, numel(out.sequence), 1);
  out.series = repmat(series, numel(out.sequence), 1);
end

function at = skip(body, at, count)
  if double(count) > numel(body) - at + 1, refuse('the body ends too early'); end
  at = at + double(count);
end

function [value, at] = varint(body, at, bits)
  value = uint64(0);
  for shift = 0:7:bits - 1
    if at > numel(body), refuse('the body ends too early'); end
    byte = uint64(body(at));
    at = at + 1;
    part = bitand(byte, uint64(127));
    if bits - shift < 7 && bitshift(part, shift - bits) ~= 0, refuse('a number of more than %d bits', bits); end
    value = bitor(value, bitshift(part, shift));
    if byte < 128, return; end
  end
  refuse('a number of too many bytes');
end

function [out, at] = alike(body, at, most)
% The ticks at a place that have the form of the first: as many bytes for each number, as many sensors.
  names = {'sequence', 'end_time_ns', 'duration_ns', 'ticks', 'missed'};
  bits = [64 64 64 16 64];
  start = at;
  places = zeros(7, 2);
  mask = uint8([]);
  for k = 1:5
    [places(k, :), mask, at] = place(body, at, start, bits(k), mask);
  end
  reals = at - start + 1;
  at = skip(body, at, 48);
  mask = [mask, zeros(1, 48, 'uint8')];
  at = skip(body, at, 1);
  mode = 0;
  from = at - 1;
  if body(from) > 1, refuse('an optional value begins with %d', body(from)); end
  if body(from) == 1
    [variant, at] = varint(body, at, 32);
    if variant > 1, refuse('there is no mode %d', variant); end
    mode = 1 - 2 * double(variant);
  end
  mask = [mask, repmat(uint8(255), 1, at - from)];
  [places(6, :), mask, at] = place(body, at, start, 16, mask);
  sensors = zeros(2, 2);
  for k = 1:4
    limit = 8 - 3 * (k > 2);
    size_of = 1 + 7 * (k > 2);
    from = at;
    [count, at] = varint(body, at, 64);
    if count > limit, refuse('%d values, at most %d', count, limit); end
    mask = [mask, repmat(uint8(255), 1, at - from), zeros(1, size_of * double(count), 'uint8')];
    if k < 3, sensors(k, :) = [at - start + 1, double(count)]; end
    at = skip(body, at, size_of * double(count));
  end
  length = at - start;
  count = min(most, floor((numel(body) - start + 1) / length));
  rows = reshape(body(start:start + length * count - 1), length, count);
  expected = bitand(rows(:, 1), mask');
  same = all(bitand(rows, repmat(mask', 1, count)) == repmat(expected, 1, count), 1);
  other = find(~same, 1);
  if ~isempty(other), count = other - 1; end
  rows = rows(:, 1:count);
  at = start + length * count;
  for k = [1 2 3 4 5 6]
    value = zeros(count, 1, 'uint64');
    for digit = places(k, 1):places(k, 2)
      value = bitor(value, bitshift(uint64(bitand(rows(digit, :)', uint8(127))), 7 * (digit - places(k, 1))));
    end
    if k == 2
      half = int64(bitshift(value, -1));
      odd = bitand(value, uint64(1)) == 1;
      half(odd) = -half(odd) - 1;
      value = half;
    end
    if k < 6, out.(names{k}) = value; else, out.flags = uint16(value); end
  end
  numbers = reshape(typecast(reshape(rows(reals:reals + 47, :), 1, []), 'double'), 6, count)';
  out.delta_angle_rad = numbers(:, 1:3);
  out.delta_velocity_m_per_s = numbers(:, 4:6);
  out.mode = repmat(int8(mode), count, 1);
  for k = 1:2
    flags = zeros(count, 8, 'uint8');
    flags(:, 1:sensors(k, 2)) = rows(sensors(k, 1):sensors(k, 1) + sensors(k, 2) - 1, :)';
    kind = {'gyro', 'accel'};
    out.([kind{k} '_flags']) = flags;
    out.([kind{k} 's']) = repmat(uint8(sensors(k, 2)), count, 1);
  end
end

function [range, mask, at] = place(body, at, start, bits, mask)
% Bytes of a number; in the mask, what of them says its length, and the bits that its type has not.
  from = at;
  [~, at] = varint(body, at, bits);
  spare = bits - 7 * (at - from - 1);
  last = uint8(128);
  if spare < 7, last = uint8(256 - 2 ^ spare); end
  mask = [mask, repmat(uint8(128), 1, at - from - 1), last];
  range = [from - start + 1, at - start];
end

function crc = crc32(bytes)
% Many bytes at once: a block's checksum is the exclusive or of what each byte at its distance from the end gives.
  persistent table
  if isempty(table)
    first = uint32(0:255)';
    for k = 1:8
      odd = bitand(first, uint32(1)) == 1;
      first = bitshift(first, -1);
      first(odd) = bitxor(first(odd), uint32(3988292384));
    end
    table = zeros(256, 1024, 'uint32');
    table(:, 1) = first;
    for k = 2:1024
      before = table(:, k - 1);
      table(:, k) = bitxor(bitshift(before, -8), first(double(bitand(before, uint32(255))) + 1));
    end
  end
  state = uint32(4294967295);
  for from = 1:1024:numel(bytes)
    block = bytes(from:min(end, from + 1023));
    count = numel(block);
    head = min(4, count);
    low = uint8(bitand(bitshift(state, -8 * (0:head - 1)), uint32(255)));
    block(1:head) = bitxor(block(1:head), low);
    given = table(double(block) + 1 + 256 * (count - 1:-1:0));
    rest = uint32(0);
    if count < 4, rest = bitshift(state, -8 * count); end
    while numel(given) > 1
      if mod(numel(given), 2) == 1, given(end + 1) = 0; end
      given = bitxor(given(1:2:end), given(2:2:end));
    end
    state = bitxor(given, rest);
  end
  crc = double(bitxor(state, uint32(4294967295)));
end
