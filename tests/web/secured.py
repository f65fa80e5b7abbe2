# SPDX-License-Identifier: Apache-2.0
"""The page over TLS."""
import base64
import hashlib
import re
import subprocess
import tempfile

from browser import Page
from case import HEIGHT, WIDTH


def public_key_of(pem_file):
    """SHA-256 of the public key of a certificate, as Chromium names it."""
    pem = subprocess.check_output(['openssl', 'x509', '-in', pem_file, '-noout', '-pubkey'])
    der = base64.b64decode(b''.join(pem.splitlines()[1:-1]))
    return base64.b64encode(hashlib.sha256(der).digest()).decode()


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
    certificate, key = case.rig.make_certificate()
    case.rig.end('bridge')
    address = case.rig.start_bridge('127.0.0.1:0', *case.bridge, '--cert', certificate, '--key', key)
    case.check(address.startswith('https://'), 'with a certificate it is https')
    trust = '--ignore-certificate-errors-spki-list=' + public_key_of(certificate)
    with tempfile.TemporaryDirectory() as folder:
        page = Page(case.chromium, folder, [trust])
        try:
            page.size(WIDTH, HEIGHT)
            page.go(address)
            case.check(page.until('document.body?.dataset.state === "live"'), 'a browser that trusts it shows the page')
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
            case.check(told == 'net::ERR_CERT_AUTHORITY_INVALID', 'any other browser warns')
        finally:
            page.close()
