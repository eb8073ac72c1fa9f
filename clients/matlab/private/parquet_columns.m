function columns = parquet_columns(bytes)
% The columns of a Parquet file of isotherm-replay convert, by name: what GNU Octave has in the place of parquetread. Where a value is
% missing there is NaN, and '' in the place of text. Errors are isotherm:refused. The format: https://parquet.apache.org/docs/file-format
  count = numel(bytes);
  if count < 12 || ~isequal(bytes([1:4, count - 3:count]), uint8('PAR1PAR1')), refuse('it does not begin and end as Parquet'); end
  length_of = little(bytes(count - 7:count - 4));
  if length_of > count - 12, refuse('its metadata would have %d bytes', length_of); end
  metadata = thrift(bytes, count - 7 - length_of, 12);
  schema = field(metadata, 2);
  parts = cell(1, numel(schema) - 1);
  parts(:) = {{}};
  for group = field(metadata, 4)
    chunks = field(group{1}, 1);
    for k = 1:numel(parts)
      parts{k}{end + 1} = chunk(bytes, field(chunks{k}, 3), schema{k + 1}, field(group{1}, 3));
    end
  end
  for k = 1:numel(parts)
    columns.(char(field(schema{k + 1}, 4))) = vertcat(parts{k}{:});
  end
end

function values = chunk(bytes, about, element, rows)
% The values of a column in a group of rows.
  packed = field(about, 4);
  if packed ~= 0 && packed ~= 1, refuse('compression %d is not read here', packed); end
  at = field(about, 9) + 1;
  if ~isempty(field(about, 11)), at = min(at, field(about, 11) + 1); end
  optional = field(element, 3) == 1;
  dictionary = [];
  parts = {}; present = [];
  while numel(present) < rows
    [header, at] = thrift(bytes, at, 12);
    body = part(bytes, at, field(header, 3));
    at = at + numel(body);
    if packed == 1, body = unsnappy(body, field(header, 2)); end
    if field(header, 1) == 2
      [dictionary, ~] = plain(body, 1, field(element, 1), field(field(header, 7), 1));
      continue
    elseif field(header, 1) ~= 0
      refuse('a page of kind %d', field(header, 1));
    end
    page = field(header, 5);
    count = field(page, 1);
    if count < 1 || count > min(rows - numel(present), 2 ^ 24), refuse('a page of %d values', count); end
    from = 1;
    here = true(count, 1);
    if optional
      size_of = little(part(body, 1, 4));
      here = hybrid(part(body, 5, size_of), 1, count) == 1;
      from = 5 + size_of;
    end
    present = [present; here];
    switch field(page, 2)
      case 0
        found = plain(body, from, field(element, 1), sum(here));
      case {2, 8}
        places = hybrid(body(from + 1:end), little(part(body, from, 1)), sum(here)) + 1;
        if any(places > numel(dictionary)), refuse('a value beyond its dictionary'); end
        found = dictionary(places);
      case 5
        found = differences(body, from, sum(here));
      otherwise
        refuse('encoding %d is not read here', field(page, 2));
    end
    parts{end + 1} = found(:);
  end
  found = vertcat(parts{:});
  if ismember(field(element, 6), [13, 14])
    found = typecast(found, strrep(class(found), 'int', 'uint'));
  end
  if all(present)
    values = found;
  elseif iscell(found)
    values = repmat({''}, rows, 1);
    values(present == 1) = found;
  else
    values = NaN(rows, 1);
    values(present == 1) = double(found);
  end
end

function [values, at] = plain(body, at, kind, count)
% Values one after the other.
  switch kind
    case 0
      bits = bitget(repmat(part(body, at, ceil(count / 8)), 8, 1), repmat((1:8)', 1, ceil(count / 8)));
      values = logical(bits(1:count)');
    case 1
      values = typecast(part(body, at, 4 * count), 'int32')';
    case 2
      values = typecast(part(body, at, 8 * count), 'int64')';
    case 5
      values = typecast(part(body, at, 8 * count), 'double')';
    case 6
      values = cell(count, 1);
      for k = 1:count
        text = part(body, at + 4, little(part(body, at, 4)));
        values{k} = char(text);
        at = at + 4 + numel(text);
      end
    otherwise
      refuse('type %d is not read here', kind);
  end
end

function values = hybrid(body, width, count)
% Small numbers of so many bits: runs of one number, and groups of eight that are packed.
  if width > 32, refuse('numbers of %d bits', width); end
  values = zeros(count, 1);
  filled = 0; at = 1;
  while filled < count
    [head, at] = varint(body, at);
    if bitand(head, uint64(1)) == 1
      many = 8 * double(bitshift(head, -1));
      run = double(unpacked(part(body, at, width * many / 8), width, many));
      at = at + width * many / 8;
    else
      many = double(bitshift(head, -1));
      run = repmat(little(part(body, at, ceil(width / 8))), min(many, count - filled), 1);
      at = at + ceil(width / 8);
    end
    if many == 0, refuse('a run of nothing'); end
    many = min(many, count - filled);
    values(filled + 1:filled + many) = run(1:many);
    filled = filled + many;
  end
end

function values = differences(body, at, count)
% Whole numbers by their differences, packed in blocks (DELTA_BINARY_PACKED).
  [block, at] = varint(body, at);
  [minis, at] = varint(body, at);
  [total, at] = varint(body, at);
  [first, at] = zigzag(body, at);
  minis = double(minis);
  each = double(block) / minis;
  if total ~= count || minis < 1 || minis > 64 || each < 1 || each > 65536 || mod(each, 8) ~= 0
    refuse('%d numbers by differences, %d are due', total, count);
  end
  % As low and high halves: their sums are exact, and what goes beyond 64 bits falls away as it did in the writer.
  halves = zeros(count, 2);
  halves(1, :) = halved(first);
  filled = 1;
  while filled < count
    [least, at] = zigzag(body, at);
    widths = part(body, at, minis);
    at = at + minis;
    for width = double(widths)
      if filled >= count, break; end
      if width > 64, refuse('differences of %d bits', width); end
      many = min(each, count - filled);
      above = unpacked(part(body, at, width * each / 8), width, each);
      halves(filled + 1:filled + many, :) = halved(above(1:many)) + halved(least);
      at = at + width * each / 8;
      filled = filled + many;
    end
  end
  halves = cumsum(halves, 1);
  high = mod(halves(:, 2) + floor(halves(:, 1) / 2 ^ 32), 2 ^ 32);
  values = typecast(bitor(bitshift(uint64(high), 32), uint64(mod(halves(:, 1), 2 ^ 32))), 'int64');
end

function halves = halved(values)
  values = typecast(values, 'uint64');
  halves = [double(bitand(values, uint64(2 ^ 32 - 1))), double(bitshift(values, -32))];
end

function values = unpacked(body, width, count)
% Numbers of so many bits, the lowest bit first.
  values = zeros(count, 1, 'uint64');
  if width == 0, return; end
  body = uint64([body(:); zeros(9, 1)]);
  from = (0:count - 1)' * width;
  place = floor(from / 8) + 1;
  offset = mod(from, 8);
  for k = 0:floor((width + 14) / 8) - 1
    values = bitor(values, bitshift(body(place + k), 8 * k - offset));
  end
  if width < 64, values = bitand(values, bitshift(uint64(1), width) - 1); end
end

function bytes = unsnappy(packed, most)
  [count, at] = varint(packed, 1);
  count = double(count);
  if count ~= most || count > 2 ^ 26, refuse('%d bytes unpacked, %d are due', count, most); end
  bytes = zeros(1, count, 'uint8');
  filled = 0;
  while filled < count
    tag = double(part(packed, at, 1));
    at = at + 1;
    many = floor(tag / 4);
    switch mod(tag, 4)
      case 0
        if many > 59
          wide = many - 59;
          many = little(part(packed, at, wide));
          at = at + wide;
        end
        many = many + 1;
        piece = part(packed, at, many);
        at = at + many;
      case 1
        back = 256 * floor(many / 8) + little(part(packed, at, 1));
        many = mod(many, 8) + 4;
        at = at + 1;
        piece = copied(bytes, filled, back, many);
      otherwise
        wide = 2 * mod(tag, 4) - 2;
        back = little(part(packed, at, wide));
        many = many + 1;
        at = at + wide;
        piece = copied(bytes, filled, back, many);
    end
    if many > count - filled, refuse('more bytes than are due'); end
    bytes(filled + 1:filled + many) = piece;
    filled = filled + many;
  end
end

function piece = copied(bytes, filled, back, many)
% What stands so many bytes back, again where it is shorter.
  if back < 1 || back > filled, refuse('a copy from %d bytes back', back); end
  piece = bytes(filled - back + 1 + mod(0:many - 1, back));
end

function [value, at] = thrift(bytes, at, kind)
% A value of Thrift's compact protocol; a structure is a cell for each number of a field.
  switch kind
    case {1, 2}
      value = kind == 1;
    case 3
      value = double(typecast(part(bytes, at, 1), 'int8'));
      at = at + 1;
    case {4, 5, 6}
      [value, at] = zigzag(bytes, at);
      value = double(value);
    case 7
      value = typecast(part(bytes, at, 8), 'double');
      at = at + 8;
    case 8
      [count, at] = varint(bytes, at);
      value = part(bytes, at, double(count));
      at = at + double(count);
    case {9, 10}
      head = part(bytes, at, 1);
      at = at + 1;
      count = double(bitshift(head, -4));
      if count == 15, [count, at] = varint(bytes, at); end
      if count > numel(bytes), refuse('a list of %d', count); end
      value = cell(1, double(count));
      for k = 1:numel(value)
        [value{k}, at] = thrift(bytes, at, double(bitand(head, uint8(15))));
      end
    case 12
      value = {};
      number = 0;
      while true
        head = double(part(bytes, at, 1));
        at = at + 1;
        if head == 0, return; end
        if head < 16
          [number, at] = zigzag(bytes, at);
          number = double(number);
        else
          number = number + floor(head / 16);
        end
        if number < 1 || number > 1000, refuse('a field %d', number); end
        [value{number}, at] = thrift(bytes, at, mod(head, 16));
      end
    otherwise
      refuse('a value of kind %d', kind);
  end
end

function value = field(structure, number)
  value = [];
  if numel(structure) >= number, value = structure{number}; end
end

function bytes = part(bytes, at, count)
  if at < 1 || count < 0 || at + count - 1 > numel(bytes), refuse('it ends too early'); end
  bytes = bytes(at:at + count - 1);
end

function value = little(bytes)
  value = sum(double(bytes) .* 256 .^ (0:numel(bytes) - 1));
end

function [value, at] = varint(bytes, at)
  value = uint64(0);
  for shift = 0:7:63
    byte = uint64(part(bytes, at, 1));
    at = at + 1;
    value = bitor(value, bitshift(bitand(byte, uint64(127)), shift));
    if byte < 128, return; end
  end
  refuse('a number of too many bytes');
end

function [value, at] = zigzag(bytes, at)
  [coded, at] = varint(bytes, at);
  value = int64(bitshift(coded, -1));
  if bitand(coded, uint64(1)) == 1, value = -value - 1; end
end

function refuse(varargin)
  error('isotherm:refused', varargin{:});
end
