# SPDX-License-Identifier: Apache-2.0
"""The page over TLS, with a CA of the lab's own."""
import base64
import hashlib
import os
import re
import ssl
import tempfile

from browser import Page
from case import HEIGHT, WIDTH


def public_key_of(pem_file):
    """SHA-256 of the public key of a certificate, as Chromium names it."""
    with open(pem_file) as text:
        der = ssl.PEM_cert_to_DER_cert(text.read())

    def element(at):
        """Where its content begins and ends (DER)."""
        length, at = der[at + 1], at + 2
        if length & 0x80:
            size = length & 0x7f
            length, at = int.from_bytes(der[at:at + size], 'big'), at + size
        return at, at + length

    at, _ = element(element(0)[0])  # what is signed, in the certificate
    for _ in range(6):              # version, number, algorithm, issuer, time, subject
        _, at = element(at)
    return base64.b64encode(hashlib.sha256(der[at:element(at)[1]]).digest()).decode()


def opens_for_one_browser(case, page):
    printed = re.findall(r'https://\S+', case.rig.log('bridge'))[-1]
    page.call('Network.clearBrowserCookies')
    page.go(printed)
    case.check(page.until('document.body?.dataset.state === "live"'), 'the printed address opens the page')
    page.call('Page.reload')
    case.check(page.until('document.body?.dataset.state === "live"'), 'which loads again')
    page.go('about:blank')
    page.go(printed)
    case.check(page.until('document.body?.dataset.state === "live"'), 'its own browser opens it again')
    page.call('Network.clearBrowserCookies')
    page.go(printed)
    case.check(page.until('document.body?.innerText.includes("This address was opened before")'), 'another one does not')
    page.go(re.findall(r'https://\S+', case.rig.log('bridge'))[-1])
    case.check(page.until('document.body?.dataset.state === "live"'), 'but the address that is printed next')


def is_secured(case):
    identity = case.rig.make_identity()
    case.rig.end('bridge')
    address = case.rig.start_bridge('127.0.0.1:0', *case.bridge, '--identity', identity)
    case.check(address.startswith('https://'), 'with an identity it is https')
    trust = '--ignore-certificate-errors-spki-list=' + public_key_of(os.path.join(identity, 'ca.pem'))
    with tempfile.TemporaryDirectory() as folder:
        page = Page(case.chromium, folder, [trust])
        try:
            page.size(WIDTH, HEIGHT)
            page.go(address)
            case.check(page.until('document.body?.dataset.state === "live"'), 'who trusts the CA has the page')
            sockets = [event['params']['url'] for event in page.events
                       if event.get('method') == 'Network.webSocketCreated']
            case.check(sockets and all(url.startswith('wss://') for url in sockets), 'over wss')
            cookies = page.call('Network.getCookies')['cookies']
            case.check(cookies and all(one['secure'] and one['httpOnly'] for one in cookies), 'the cookie is secure')
            opens_for_one_browser(case, page)
            page.call('Network.clearBrowserCookies')
            page.go(address.split('?')[0] + '?token=a-token-that-is-none')
            case.check(page.until('document.body?.innerText.includes("This address was opened before, or is of another start")'),
                       'a wrong token is told')
            page.go(address.replace('https:', 'http:'))
            case.check(page.until('document.body?.innerText.includes("This port speaks TLS only: open it with https://")'),
                       'so is plain HTTP')
        finally:
            page.close()
    with tempfile.TemporaryDirectory() as folder:
        page = Page(case.chromium, folder)
        try:
            told = page.call('Page.navigate', url=address).get('errorText')
            case.check(told == 'net::ERR_CERT_AUTHORITY_INVALID', 'who does not trust the CA is warned by the browser')
        finally:
            page.close()
